//! Benchmarks: speed against error of every method, numerical stability, and the sampler's weights.
//!
//! - `methods`: time, memory, build time and error of the published methods, the colour table and the spectral
//!   tables, over their parameters.
//! - [`sampler`]: statistics of the weights of importance sampling.
//! - [`stability`]: the sweeps of docs/model.md#hard-cases: deep relief, grazing directions, random queries.
//!
//! `Truth` computes the reference spectra; `directions` the pairs of directions at which methods are compared. The
//! subcommands of `sunbeam bench` print the results.

mod directions;
mod error;
pub(crate) mod methods;
pub mod sampler;
pub mod stability;
mod truth;

pub(crate) use directions::{DirectionPair, INCIDENT_DEG, directions};
pub use error::BenchError;
pub(crate) use truth::{Truth, TruthCheck};
