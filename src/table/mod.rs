//! Tables of the power density `S(f; κ)` of docs/model.md#the-reflectance, read with a handful of look-ups.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | `f = (u, v)/λ` | spatial frequency in cycles/µm, with `(u, v, w) = wi + wo` |
//! | `κ = 2πw/λ` | phase rate in rad/µm: heights h become phases κh |
//! | `j` | a node of the frequency lattice, at `(jx/Px, jy/Py)` for periods P in µm |
//! | `p` | the frequency in nodes, `(f.x·Px, f.y·Py)` |
//! | `e_j` | interpolation weight: the product over both axes of [`InterpolationKernel::weight`] of `p − j` |
//! | `P_j(κ)`, `D_j(κ)` | power and complex amplitude of node j |
//!
//! - *ensemble*: `S(f; κ) = norm · Σ_j e_j · P_j(κ)`,
//! - *patch*: `S(f; κ) = norm · |Σ_j e_j · D_j(κ)|²`.
//!
//! Over κ each node is a cubic B-spline of a scaled quantity that stays finite as κ → 0 ([`SpectralTable`]). Relative
//! accuracy then survives at grazing angles, where the reflectance divides by w².
//!
//! A build goes through the files in this order: `estimate.rs` (cost, refused or not), `lattice.rs` with `kernel.rs`
//! and `band.rs` (the nodes), `spectrum.rs` (all nodes at one κ), `build.rs` with `knots.rs` and `spline.rs` (splines
//! over κ), `spectral.rs` (the table in single precision), `packed.rs` with `format.rs` (its 32-bit words), `view.rs`
//! (the look-up).

mod advice;
mod band;
mod build;
mod coherence;
mod error;
mod estimate;
mod format;
mod kernel;
mod knots;
mod lattice;
mod node_curve;
mod packed;
mod progress;
mod spectral;
mod spectrum;
mod spline;
mod view;

pub use build::{Built, DENSITY_FLOOR_UM2, TableReport, build};
pub use coherence::{CoherenceWindow, Model, Tiling};
pub use error::TableError;
pub use estimate::{BUILD_LIMIT, BuildDemand, Estimate, LIMIT_BYTES, LIMIT_SECONDS, Purpose};
pub use format::Format;
pub use kernel::InterpolationKernel;
pub(crate) use lattice::lag_grid;
pub use lattice::{Lattice, LatticeAxis};
pub use node_curve::NodeCurve;
pub(crate) use node_curve::PowerCurves;
pub use packed::{PackedLayout, PackedTable};
pub use progress::{Progress, Steps};
pub use spectral::{HEADER, NodeQuantity, SpectralTable};
pub use spectrum::Spectrum;
pub(crate) use spectrum::taper;
pub(crate) use spline::POLE;
pub use view::TableView;

use std::ops::RangeInclusive;

/// Shortest tabulated wavelength in nm: the lower end of Mitsuba's spectra (`MI_CIE_MIN`).
pub const WAVELENGTH_MIN_NM: f64 = 360.0;
/// Longest tabulated wavelength in nm: the upper end of Mitsuba's spectra (`MI_CIE_MAX`).
pub const WAVELENGTH_MAX_NM: f64 = 830.0;
/// Highest spatial frequency `|f|` of any pair of directions, in cycles/µm: `|wi + wo| ≤ 2` over the shortest
/// wavelength.
pub const FREQUENCY_MAX_PER_UM: f64 = 2e3 / WAVELENGTH_MIN_NM;
/// Accepted coherence lengths in µm: beyond any light and any relief at both ends (chosen).
pub const COHERENCE_LENGTH_UM: RangeInclusive<f64> = 1e-3..=1e5;
/// Accepted relative errors of tables. Rounding to single precision limits the lower end.
pub const TOLERANCE: RangeInclusive<f64> = 1e-6..=0.1;
