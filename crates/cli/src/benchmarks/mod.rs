//! Speed against error of every way to evaluate a surface, and its numerical stability.
//!
//! - [`methods`]: time, memory, build time and error against the oracle of the published methods, of the colour table
//!   and of the spectral tables, over their parameters.
//! - [`sampler`]: how evenly importance sampling weighs what it finds.
//! - [`stability`]: docs/model.md#hard-cases, swept: deep relief, grazing directions, random questions.
//!
//! [`Truth`] is the oracle over whole spectra. Nothing but the command line uses this room.

mod directions;
mod error;
pub mod methods;
pub mod sampler;
pub mod stability;
mod truth;

pub use directions::{DirectionPair, INCIDENT_DEG, directions};
pub use error::BenchError;
pub use truth::{Truth, TruthCheck};
