//! The colour table against the integral that it tabulates, taken at every nm from the spectral table, which
//! `tables.rs` compares with the oracle.

use super::common::colour_differences;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::OnceLock;
use sunbeam::colour::SpectralToRgb;
use sunbeam::config::SurfaceConfig;
use sunbeam::height_field::HeightField;
use sunbeam::lobe::Exact;
use sunbeam::methods::{ColourTable, ColourTableOptions, Relief};
use sunbeam::scattering::{Obliquity, Options, Pair};
use sunbeam::table::{CoherenceWindow, Model, PackedTable, Progress, Spectrum, Tiling, build};

const TOLERANCE: f64 = 1e-3;
/// Largest invisible colour difference, and the fraction of pixels that must stay below.
const DELTA_E: f64 = 1.0;
const PERCENTILE: f64 = 0.99;

struct Case {
    field: HeightField,
    options: ColourTableOptions,
    /// The spectral table, built on demand for the true colours.
    spectral: OnceLock<PackedTable>,
}

impl Case {
    fn new(json: &str, model: Model) -> Self {
        let config = SurfaceConfig::from_json(json).unwrap();
        let field = config.height_field().unwrap();
        let options = ColourTableOptions {
            coherence_length_um: config.coherence_length,
            model,
            tiling: config.tiling(),
            tolerance: TOLERANCE,
            resolution: 1.0,
            build_limit: 1.0,
        };
        Self { field, options, spectral: OnceLock::new() }
    }

    fn spectral(&self) -> &PackedTable {
        self.spectral.get_or_init(|| {
            let ColourTableOptions { coherence_length_um, model, tiling, .. } = self.options;
            let window = CoherenceWindow::new(coherence_length_um);
            let spectrum = Spectrum::new(&self.field, model, tiling, window, TOLERANCE);
            build(&spectrum, TOLERANCE, &Progress::none()).unwrap().packed
        })
    }

    fn table(&self) -> ColourTable {
        ColourTable::build(&self.field, &self.options).unwrap()
    }

    fn truth(&self, spectrum: &SpectralToRgb, pair: &Pair) -> [f64; 3] {
        let spectral = self.spectral();
        spectrum.rgb_of(|nm| {
            let um = nm * 1e-3;
            spectral.density([pair.u / um, pair.v / um], TAU * pair.w / um) / (um * um)
        })
    }

    /// ΔE₀₀ over the hemisphere for one `wi`, ascending, at an exposure that clips a tenth of the lit directions.
    fn colour_errors(&self, table: &ColourTable, theta_deg: f64, phi_deg: f64) -> Vec<f64> {
        const SIZE: usize = 64;
        let spectrum = SpectralToRgb::visible(1.0).unwrap();
        let ((sin, cos), (sin_phi, cos_phi)) = (theta_deg.to_radians().sin_cos(), phi_deg.to_radians().sin_cos());
        let wi = [sin * cos_phi, sin * sin_phi, cos];
        let pixels: Vec<([f64; 3], [f64; 3])> = (0..SIZE * SIZE)
            .into_par_iter()
            .filter_map(|i| {
                let place = |i: usize| (2 * i + 1) as f64 / SIZE as f64 - 1.0;
                let (x, y) = (place(i % SIZE), place(i / SIZE));
                let pair = Pair::new(wi, [x, y, (1.0 - x * x - y * y).max(0.0).sqrt()])?;
                let factor = pair.obliquity(Obliquity::Stam);
                let found = table.relief_rgb([pair.u as f32, pair.v as f32, pair.w as f32]);
                let truth = self.truth(&spectrum, &pair);
                Some((truth.map(|v| v * factor), found.map(|v| f64::from(v) * factor)))
            })
            .collect();
        colour_differences(&pixels)
    }
}

fn percentile(errors: &[f64]) -> f64 {
    errors[(PERCENTILE * (errors.len() - 1) as f64) as usize]
}

fn check(json: &str, model: Model, megabytes: f64) {
    let case = Case::new(json, model);
    let table = case.table();
    assert!(table.report().bytes as f64 <= megabytes * 1e6, "{json}: {} bytes", table.report().bytes);
    assert_eq!(table.report().coherence_length_um, case.options.coherence_length_um);
    for (theta, phi) in [(0.0, 0.0), (30.0, 20.0), (60.0, 100.0), (80.0, 0.0)] {
        let error = percentile(&case.colour_errors(&table, theta, phi));
        assert!(error < DELTA_E, "{json} at {theta}°, {phi}°: ΔE {error:.2}");
    }
}

#[test]
fn gratings_are_within_a_just_visible_difference() {
    check(r#"{"preset":"blazed"}"#, Model::Patch, 10.0);
    check(r#"{"preset":"cd"}"#, Model::Patch, 10.0);
}

#[test]
fn skins_are_within_a_just_visible_difference() {
    check(r#"{"preset":"elaphe"}"#, Model::Ensemble, 10.0);
    check(r#"{"preset":"xenopeltis"}"#, Model::Patch, 10.0);
}

#[test]
fn scans_are_within_a_just_visible_difference() {
    let Some(elaphe) = sunbeam_testing::data("afm/elaphe.gsf") else { return };
    let Some(xenopeltis) = sunbeam_testing::data("afm/xenopeltis.gsf") else { return };
    check(&format!(r#"{{"filename":{elaphe:?},"tiling":"periodic"}}"#), Model::Patch, 10.0);
    check(&format!(r#"{{"filename":{xenopeltis:?}}}"#), Model::Ensemble, 10.0);
}

#[test]
fn a_coarse_table_exceeds_the_visible_difference() {
    let mut case = Case::new(r#"{"preset":"elaphe","coherence_length":10}"#, Model::Patch);
    let good = percentile(&case.colour_errors(&case.table(), 30.0, 20.0));
    case.options.resolution = 0.4;
    let coarse = percentile(&case.colour_errors(&case.table(), 30.0, 20.0));
    assert!(good < DELTA_E && coarse > 3.0 * DELTA_E, "{good} {coarse}");
}

#[test]
fn the_oracle_agrees_at_single_pairs() {
    let case = Case::new(r#"{"preset":"sinusoidal"}"#, Model::Patch);
    let table = case.table();
    let options =
        Options { model: Model::Patch, obliquity: Obliquity::Unit, conserve_energy: false, ..Options::default() };
    let exact = Exact::new(&case.field, &options, None);
    let spectrum = SpectralToRgb::visible(1.0).unwrap();
    let mut peak = 0.0f64;
    let mut worst = 0.0f64;
    for i in 0..40 {
        let (sin, cos) = (0.02 + 0.02 * f64::from(i), 0.004 * f64::from(i % 3));
        let (wi, wo) = ([0.3, 0.1, (1.0f64 - 0.1).sqrt()], [sin - 0.3, cos - 0.1, 0.0]);
        let wo = [wo[0], wo[1], (1.0 - wo[0] * wo[0] - wo[1] * wo[1]).sqrt()];
        let truth = spectrum.rgb_of(|nm| exact.eval(wi, wo, nm));
        let found = table.relief_rgb([0, 1, 2].map(|c| (wi[c] + wo[c]) as f32));
        for (found, truth) in found.iter().zip(truth) {
            peak = peak.max(truth.abs());
            worst = worst.max((f64::from(*found) - truth).abs());
        }
    }
    // Splines have an error of 1.2 % of a peak as narrow as an order at 450 nm, mantissas of nine bits one of 0.4 %.
    assert!(worst < 0.02 * peak, "{worst} of {peak}");
}

#[test]
fn a_mirror_is_white_in_its_mirror_direction() {
    let case = Case::new(r#"{"preset":"flat"}"#, Model::Ensemble);
    let [r, g, b] = case.table().relief_rgb([0.0, 0.0, 1.2]);
    let expected =
        case.truth(&SpectralToRgb::visible(1.0).unwrap(), &Pair { u: 0.0, v: 0.0, w: 1.2, cos_i: 0.6, cos_o: 0.6 });
    for (found, expected) in [r, g, b].iter().zip(expected) {
        // Four rings interpolate the narrowest Gaussian, the blue one.
        assert!((f64::from(*found) / expected - 1.0).abs() < 0.02, "{found} {expected}");
    }
}

#[test]
fn lookups_at_the_edges_are_finite() {
    for json in [
        r#"{"preset":"flat"}"#,
        // κH = 200 at 360 nm along the normal.
        r#"{"preset":"blazed","height":6}"#,
        r#"{"preset":"sinusoidal","coherence_length":1}"#,
    ] {
        let table = Case::new(json, Model::Ensemble).table();
        for u in [-2.0f32, -1.0, -1e-7, 0.0, 1e-7, 0.7, 1.99999, 2.0] {
            for v in [-2.0f32, -1e-7, 0.0, 0.3, 2.0] {
                for w in [1e-7f32, 1e-3, 0.5, 1.9999, 2.0] {
                    assert!(table.relief_rgb([u, v, w]).iter().all(|c| c.is_finite()), "{json} {u} {v} {w}");
                }
            }
        }
        for q in
            [[f32::NAN, 0.0, 1.0], [0.0, 0.0, f32::NAN], [0.0, 0.0, -1.0], [f32::INFINITY, 0.0, 1.0], [0.0, 0.0, 0.0]]
        {
            assert_eq!(table.relief_rgb(q), [0.0; 3]);
        }
    }
}

#[test]
fn long_coherence_is_shown_as_far_as_the_limit_allows() {
    let case = Case::new(r#"{"preset":"blazed","coherence_length":10000}"#, Model::Ensemble);
    let report = *case.table().report();
    assert!(report.coherence_length_um < 1000.0 && report.coherence_length_um > 65.0, "{report:?}");
    assert!(report.bytes <= ColourTable::LIMIT_BYTES);
}

#[test]
fn options_out_of_range_are_named() {
    let case = Case::new(r#"{"preset":"flat"}"#, Model::Ensemble);
    let field = &case.field;
    let good = ColourTableOptions { tiling: Tiling::Periodic, ..case.options };
    for (bad, name) in [
        (ColourTableOptions { coherence_length_um: f64::NAN, ..good }, "coherence_length"),
        (ColourTableOptions { tolerance: 0.0, ..good }, "tolerance"),
        (ColourTableOptions { resolution: 9.0, ..good }, "resolution"),
    ] {
        let error = ColourTable::build(field, &bad).err().unwrap().to_string();
        assert!(error.contains(name), "{error}");
    }
}
