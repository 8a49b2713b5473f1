//! Tables from which the power density `S(f; κ)` of docs/model.md#the-reflectance is read with a handful of look-ups.
//!
//! A table is a lattice of spatial frequencies. Each node of it carries, as functions of κ, what the model needs
//! there (an order power, or a complex amplitude), and weights join the nodes:
//!
//! - *ensemble*: `S(f; κ) = norm · Σ_j e_j · P_j(κ)`,
//! - *patch*: `S(f; κ) = norm · |Σ_j e_j · D_j(κ)|²`,
//!
//! with `e_j` the product along both axes of a weight ([`Joining`]) of `p − j`, `p` the frequency in lattice units. Where the tile repeats and the coherence
//! window is of its size, the lattice is that of the orders and `P_j = |c_j|²`, `D_j = c_j` without any
//! approximation. For a window much smaller than the tile, and for a scan that does not repeat, [`lattice`] picks
//! another period and the window is applied beforehand ([`spectrum`]).
//!
//! In κ each node is a cubic B-spline ([`spline`]) of a quantity that stays finite as κ → 0, so that relative
//! accuracy survives at grazing angles where the reflectance divides by w².

mod band;
mod build;
mod error;
mod estimate;
mod joining;
mod lattice;
mod lookup;
mod packed;
mod progress;
mod spectrum;
mod spline;
mod view;

pub use build::{Built, DENSITY_FLOOR_UM2, TableReport, build};
pub use error::TableError;
pub use estimate::{BUILD_LIMIT, BuildDemand, Estimate, LIMIT_BYTES, LIMIT_SECONDS, Purpose};
pub use joining::Joining;
pub use lattice::{Lattice, LatticeAxis};
pub(crate) use lookup::PowerCurves;
pub use lookup::{HEADER, KernelKind, NodeCurve, SpectralTable};
pub use packed::{Format, PackedLayout, PackedTable};
pub use progress::{Progress, Steps};
pub use spectrum::{Model, Spectrum, Tiling};
pub(crate) use spectrum::{lag_grid, taper};
pub use view::TableView;

/// Shortest wavelength a table answers for, in nm.
pub const WAVELENGTH_MIN_NM: f64 = 360.0;
/// Longest wavelength a table answers for, in nm.
pub const WAVELENGTH_MAX_NM: f64 = 830.0;
/// Accepted coherence lengths in µm.
pub const COHERENCE_LENGTH_UM: std::ops::RangeInclusive<f64> = 1e-3..=1e5;
/// Accepted relative errors of the tables.
pub const TOLERANCE: std::ops::RangeInclusive<f64> = 1e-6..=0.1;
