//! The measurements of `sunbeam bench`: speed against error of every method, numerical stability, and the sampler's
//! weights.
//!
//! - `methods`: time, memory, build time and error of the published methods, the colour table and the spectral
//!   tables, over their parameters.
//! - [`sampler`]: statistics of the weights of importance sampling.
//! - [`stability`]: the sweeps of docs/model.md#hard-cases: deep relief, grazing directions, random queries.
//!
//! `Truth` computes the spectra with which methods are compared, `direction_pairs` the pairs of directions for that.

mod directions;
mod error;
pub(crate) mod methods;
pub mod sampler;
pub mod stability;
mod truth;

pub(crate) use directions::{DirectionPair, INCIDENT_DEG, direction_pairs};
pub use error::BenchError;
pub(crate) use truth::{Truth, TruthCheck};

/// Sorts `values` and returns their 99th percentile: an element that at least 99 % of them do not exceed. 0 for an
/// empty slice.
fn percentile_99(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get((0.99 * values.len().saturating_sub(1) as f64).ceil() as usize).copied().unwrap_or(0.0)
}
