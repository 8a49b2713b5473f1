//! One line that tells a surface, for `str(bsdf)`.

use crate::cache::Origin;
use crate::config::{Source, SurfaceConfig};
use crate::reflectance::SurfaceReport;

/// The configuration, its tables and their error.
pub fn describe(config: &SurfaceConfig, report: &SurfaceReport, origin: &Origin) -> String {
    format!("{}; {}", describe_config(config), describe_tables(report, origin))
}

fn describe_config(config: &SurfaceConfig) -> String {
    let source = match config.source() {
        Source::Preset(preset) => {
            let size = |name, given: Option<f64>| given.map(|v| format!(", {name} {v} µm")).unwrap_or_default();
            format!("{}{}{}", preset.name(), size("period", config.period), size("height", config.height))
        }
        Source::File(path) => path.display().to_string(),
    };
    // The parameters' own spelling.
    let name = |choice: &dyn std::fmt::Debug| format!("{choice:?}").to_lowercase();
    format!(
        "{source}; {} over {} µm, {} tiling, {} obliquity, level {}, conserve_energy {}, shadowing {}, tolerance {:e}",
        name(&config.model),
        config.coherence_length,
        name(&config.tiling()),
        name(&config.obliquity),
        config.level(),
        config.conserve_energy(),
        config.shadowing,
        config.tolerance
    )
}

fn describe_tables(report: &SurfaceReport, origin: &Origin) -> String {
    let table = &report.table;
    let scaled = report.energy.map_or(String::new(), |energy| {
        format!(
            ", mean albedo {:.4} scaled from {:.4} to conserve energy",
            energy.albedo_mean_scaled, energy.albedo_mean_unscaled
        )
    });
    format!(
        "tables of {:.2} MB, {origin} ({:.2} s to build), {} x {} look-ups of {} nodes with {} knots, relative error {:.1e}{scaled}",
        report.bytes as f64 / 1e6,
        report.build_seconds,
        table.taps.0,
        table.taps.1,
        table.nodes,
        table.kappa_knots,
        table.relative_error
    )
}
