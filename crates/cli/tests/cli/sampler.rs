//! How evenly the sampler weighs (docs/model.md#sampling), in the statistics of `sunbeam bench --what sampler`.

use super::common::{built as build, direction, preset, waves};
use sunbeam::height_field::Preset;
use sunbeam::lobe::Surface;
use sunbeam::scattering::Options;
use sunbeam::table::Tiling;
use sunbeam_cli::benchmarks::sampler::{sampler, sampler_row};

/// Standard errors a Monte Carlo mean may lie off (6e-5 of all seeds).
const STANDARD_ERRORS: f64 = 4.0;

/// Samples of each incidence and wavelength: the 99.9th percentile has 10 above it.
const WEIGHTS: usize = 10_000;
/// Deviation of the weights over their mean, up to 75° and at 85°, of gratings. What is left are orders that leave along the
/// surface: within their width the obliquity factor, the albedo and `1/cosθo` go from much to nothing.
const GRATINGS: (f64, f64) = (0.5, 0.8);
/// The same of what is drawn in squares: 1.21 is the largest that was found when squares were chosen, over all incidences of two
/// skins and two scans. More even weights were had, for several times the time of a sample and its density; time × (1 + variance
/// of the picture) is less this way. Powers are read at one κ for all directions, and corners of the square are lost.
const SQUARES: (f64, f64) = (1.21, 1.3);
/// 99.9th percentile over the mean.
const PERCENTILE: f64 = 12.0;
/// Largest weight over the mean: `1/cosθo` has its pole at the horizon.
const LARGEST: f64 = 40.0;

/// Holds the statistics of a surface against the limits.
fn weighs_evenly(name: &str, surface: &Surface, limits: (f64, f64)) {
    for row in sampler(surface, WEIGHTS) {
        let deviation = if row.theta_deg > 80.0 { limits.1 } else { limits.0 };
        assert!(row.relative_std <= deviation, "{name}: {row:?}");
        assert!(row.p999_to_mean <= PERCENTILE, "{name}: {row:?}");
        assert!(row.max_to_mean <= LARGEST, "{name}: {row:?}");
    }
}

#[test]
fn gratings_are_weighed_evenly() {
    for name in [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar] {
        weighs_evenly(name.name(), &build(&preset(name), &Options::default()), GRATINGS);
    }
}

#[test]
fn large_tiles_are_weighed_evenly() {
    for name in [Preset::Cd, Preset::Elaphe, Preset::Xenopeltis] {
        weighs_evenly(name.name(), &build(&preset(name), &Options::default()), SQUARES);
    }
}

#[test]
fn a_scan_that_stands_alone_is_weighed_evenly() {
    let options = Options { tiling: Tiling::Aperiodic, ..Options::default() };
    weighs_evenly("waves", &build(&waves(100, 100, 0.065, 0.065, 0.4), &options), SQUARES);
}

#[test]
fn weights_average_to_the_albedo() {
    for name in [Preset::Blazed, Preset::Sinusoidal, Preset::Lamellar] {
        let surface = build(&preset(name), &Options::default());
        for theta in [0.0, 30.0, 60.0, 75.0, 85.0] {
            let row = sampler_row(&surface, theta, 25.0, 530.0, 50_000);
            let albedo = surface.albedo(direction(theta, 25.0), 530.0).unwrap();
            let error = row.mean * row.relative_std / 50_000f64.sqrt();
            // Half a per mille for the tables.
            assert!((row.mean - albedo).abs() < STANDARD_ERRORS * error + 1e-3, "{} ± {error}: {albedo}", row.mean);
        }
    }
}
