//! Parts of the line that describes a surface in `str(bsdf)`: its parameters, and its tables with their size, origin
//! (built or read from the cache), build time and error.

use sunbeam::cache::Origin;
use sunbeam::config::{Source, SurfaceConfig, Theory};
use sunbeam::grating::GratingSurface;
use sunbeam::lobe::{ColourSurface, SurfaceReport};

/// The parameters of a surface. Those of the relief and its body are left out where they have their defaults. Those
/// after the semicolon are always there.
pub(crate) fn config(config: &SurfaceConfig) -> String {
    let source = match config.source() {
        Source::Preset(preset) => {
            let length = |label, um: Option<f64>| um.map(|um| format!(", {label} {um} µm")).unwrap_or_default();
            format!("{}{}{}", preset.name(), length("period", config.period), length("height", config.height))
        }
        Source::File(path) => path.display().to_string(),
    };
    let factor = |label, value: f64| if value == 1.0 { String::new() } else { format!(", {label} {value}") };
    let cover = config.cover_eta.map(|eta| format!(", cover_eta {eta}")).unwrap_or_default();
    let transmission = match config.body() {
        Some(body) => format!(", transmission {}, eta {}", config.transmission.name(), body.eta),
        None => String::new(),
    };
    // Scale and depth given as numbers have a `factor`; given as textures they have a range of values.
    let span = |label, [low, high]: [f64; 2]| format!(", {label} {low:.3} to {high:.3}");
    let sizes = config.sizes.map(|sizes| span("scale", sizes.scale) + &span("depth", sizes.depth)).unwrap_or_default();
    let (scale, depth) = (factor("scale", config.scale), factor("depth", config.depth));
    let source = format!("{source}{scale}{depth}{sizes}{cover}{transmission}");
    if config.theory == Theory::Rigorous {
        return format!("{source}; theory rigorous, over {} µm, level {}", config.coherence_length, config.level());
    }
    // The value of a parameter as users write it: the variant's name in lower case.
    let name = |choice: &dyn std::fmt::Debug| format!("{choice:?}").to_lowercase();
    format!(
        "{source}; {} over {} µm, {} tiling, {} obliquity, level {}, conserve_energy {}, shadowing {}, tolerance {:e}",
        name(&config.model),
        config.coherence_length,
        name(&config.tiling()),
        config.obliquity.name(),
        config.level(),
        config.conserve_energy(),
        config.shadowing,
        config.tolerance
    )
}

/// The tables of a surface of scalar theory in spectral variants. `origin` tells whether they were built or read from
/// the cache.
pub(crate) fn tables(report: &SurfaceReport, origin: &Origin) -> String {
    let table = &report.table;
    // Numbers of nodes along x and y that a look-up reads. Each node has a value at each knot in κ, the phase rate.
    let (taps_x, taps_y) = table.taps;
    // Empty if energy is not conserved, and for a transparent body.
    let scaled = report.energy.map_or(String::new(), |energy| {
        format!(
            ", mean albedo {:.4} scaled from {:.4} to conserve energy",
            energy.albedo_mean_scaled, energy.albedo_mean_unscaled
        )
    });
    format!(
        "tables of {:.2} MB, {origin} ({:.2} s to build), {} x {} look-ups of {} nodes with {} knots, relative error \
         {:.1e}{scaled}",
        report.bytes as f64 / 1e6,
        report.build_seconds,
        taps_x,
        taps_y,
        table.nodes,
        table.kappa_knots,
        table.relative_error
    )
}

/// The tables of a surface of scalar theory in RGB and mono variants.
pub(crate) fn colours(surface: &ColourSurface, origin: &Origin) -> String {
    let report = surface.report();
    let bytes = report.table_bytes + report.sampler_bytes + report.albedo_bytes;
    // A reference index is the one whose Fresnel reflectance the colours include.
    let fresnel = if surface.reference().is_some() { "included" } else { "applied per sample" };
    format!(
        "tables of colours of {:.2} MB, {origin} ({:.2} s to build), {} rings over {} µm of coherence, relative error \
         {:.1e} of the spectra, Fresnel reflectance {fresnel}",
        bytes as f64 / 1e6,
        report.build_seconds,
        surface.table().report().rings,
        report.coherence_length_um,
        surface.table().report().spectral_error,
    )
}

/// The tables of a grating of rigorous theory. `bytes` is the size of all of them, including the colours and Jones
/// matrices of a surface that has these.
pub(crate) fn grating(grating: &GratingSurface, bytes: usize, origin: &Origin) -> String {
    let report = grating.report();
    format!(
        "orders by Maxwell's equations in tables of {:.2} MB, {origin} ({:.2} s to build), {} incidences solved, root \
         mean square error of an order {:.1e}",
        bytes as f64 / 1e6,
        report.build_seconds,
        report.solved,
        report.rms,
    )
}
