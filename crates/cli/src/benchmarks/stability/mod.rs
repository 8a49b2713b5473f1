//! Sweeps over the hard cases of docs/model.md#hard-cases: deep relief, grazing directions, and random queries.
//!
//! Symbols:
//!
//! - wi, wo: the directions to light and viewer; (u, v, w) = wi + wo;
//! - λ: the wavelength in µm;
//! - f = (u, v)/λ: the spatial frequency in cycles/µm; κ = 2πw/λ: the phase rate in rad/µm;
//! - S(f; κ): the power spectral density of the relief in µm².

mod deep;
mod grazing;
mod random_queries;
mod relief;

pub use deep::{DeepPoint, KAPPA_H, deep_relief};
pub use grazing::{GRAZING_DEG, GrazingPoint, GrazingSurface, grazing};
pub use random_queries::{RandomQueries, random_queries};

use super::{BenchError, percentile_99};
use serde::Serialize;
use std::f64::consts::TAU;
use sunbeam::lobe::{Exact, Surface};
use sunbeam::scattering::Vec3;
use sunbeam::table::DENSITY_FLOOR_UM2;

/// The size of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Effort {
    /// Pairs of directions at each depth of relief, and at each angle of incidence on each surface.
    pub directions: usize,
    /// Random queries: pairs of directions with a wavelength.
    #[serde(rename = "questions")]
    pub queries: u64,
}

impl Effort {
    /// The run behind the figures of the documentation: minutes.
    pub const FULL: Self = Self { directions: 300, queries: 10_000_000 };
    /// A run of seconds.
    pub const QUICK: Self = Self { directions: 20, queries: 20_000 };
}

/// The results of all sweeps. The JSON's keys, which docs/templates/stability.md.j2 reads, say "questions" for queries.
#[derive(Clone, Debug, Serialize)]
pub struct StabilityFigures {
    /// One point for each of [`KAPPA_H`].
    pub deep_relief: Vec<DeepPoint>,
    /// One sweep for each surface.
    pub grazing: Vec<GrazingSurface>,
    /// Counts and extremes over all random queries.
    #[serde(rename = "questions")]
    pub random_queries: RandomQueries,
}

/// Runs all sweeps; `progress` receives the name of each when it begins.
///
/// # Errors
/// A surface or a method that cannot be built.
pub fn measure(effort: &Effort, progress: &mut dyn FnMut(&str)) -> Result<StabilityFigures, BenchError> {
    progress("deep relief");
    let deep_relief = deep_relief(effort.directions)?;
    progress("grazing directions");
    let grazing = grazing(effort.directions)?;
    progress("random queries");
    let random_queries = random_queries(effort.queries)?;
    Ok(StabilityFigures { deep_relief, grazing, random_queries })
}

/// Error of a table's power spectral density S(f; κ) against `exact`, the direct sum of the same surface, relative to
/// [`error_scale`].
fn table_error(surface: &Surface, exact: &Exact, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
    let wavelength_um = wavelength_nm * 1e-3;
    let f = [(wi[0] + wo[0]) / wavelength_um, (wi[1] + wo[1]) / wavelength_um];
    let kappa = TAU * (wi[2] + wo[2]) / wavelength_um;
    let table = surface.table();
    let truth = exact.power_density(f, kappa);
    (table.density(f, kappa) - truth).abs() / error_scale(truth, table.hemisphere_mean(f, wi[2], wavelength_um))
}

/// The scale in µm² to which a table's tolerance refers: the largest of the direct sum's S, a mean of S at the same
/// frequency, and [`DENSITY_FLOOR_UM2`], a hundredth of the S of a white diffuse surface.
///
/// For tables, the mean is over the κ of all outgoing directions ([`table_error`]). For methods of the patch model, it
/// is over all positions of the coherence window (deep.rs).
fn error_scale(truth_um2: f64, mean_um2: f64) -> f64 {
    truth_um2.max(mean_um2).max(DENSITY_FLOOR_UM2)
}

/// The largest of non-negative values; 0 without values, infinity if one is NaN.
fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most, value| if value.is_nan() { f64::INFINITY } else { value.max(most) })
}
