//! The hard cases of docs/model.md#hard-cases, swept: deep relief, grazing directions, and questions drawn at random.

mod deep;
mod grazing;
mod questions;
mod relief;

pub use deep::{DeepPoint, KAPPA_H, deep_relief};
pub use grazing::{GRAZING_DEG, GrazingPoint, GrazingSurface, grazing};
pub use questions::{Questions, questions};

use super::BenchError;
use serde::Serialize;
use std::f64::consts::TAU;
use sunbeam::lobe::{Exact, Surface};
use sunbeam::scattering::Vec3;
use sunbeam::table::DENSITY_FLOOR_UM2;

/// How many questions are put.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Effort {
    /// Pairs of directions at each depth of relief, and at each angle of incidence.
    pub directions: usize,
    /// Questions drawn at random.
    pub questions: u64,
}

impl Effort {
    /// Ten million questions.
    pub const FULL: Self = Self { directions: 300, questions: 10_000_000 };
    /// A look in seconds.
    pub const QUICK: Self = Self { directions: 20, questions: 20_000 };
}

/// Everything.
#[derive(Clone, Debug, Serialize)]
pub struct StabilityFigures {
    /// By κH.
    pub deep_relief: Vec<DeepPoint>,
    pub grazing: Vec<GrazingSurface>,
    pub questions: Questions,
}

/// Sweeps all of them; `progress` is told what is being done.
///
/// # Errors
/// A surface that was not made.
pub fn measure(effort: &Effort, progress: &mut dyn FnMut(&str)) -> Result<StabilityFigures, BenchError> {
    progress("deep relief");
    let deep_relief = deep_relief(effort.directions)?;
    progress("grazing directions");
    let grazing = grazing(effort.directions)?;
    progress("random questions");
    let questions = questions(effort.questions)?;
    Ok(StabilityFigures { deep_relief, grazing, questions })
}

/// Error of the table's S against the oracle's, relative to the largest of the oracle's, the mean over κ there and the
/// density floor: what a table's tolerance is meant for.
fn table_error(surface: &Surface, exact: &Exact, wi: Vec3, wo: Vec3, wavelength_nm: f64) -> f64 {
    let um = wavelength_nm * 1e-3;
    let f = [(wi[0] + wo[0]) / um, (wi[1] + wo[1]) / um];
    let kappa = TAU * (wi[2] + wo[2]) / um;
    let table = surface.table();
    let value = table.density(f, kappa);
    let truth = exact.power_density(f, kappa);
    (value - truth).abs() / truth.max(table.hemisphere_mean(f, wi[2], um)).max(DENSITY_FLOOR_UM2)
}

/// The largest, infinity where one is not a number.
fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most, value| if value.is_nan() { f64::INFINITY } else { value.max(most) })
}

/// The smallest value that 99 of 100 do not exceed.
fn percentile_99(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get((0.99 * values.len().saturating_sub(1) as f64).ceil() as usize).copied().unwrap_or(0.0)
}
