//! Tables of the power density `S(f; κ)` (docs/model.md#the-reflectance) of one height field, read in a few look-ups.
//!
//! - `f`: spatial frequency along x and y in cycles/µm, `(wi + wo)_xy / λ`.
//! - `κ`: vertical wave number in rad/µm, `2π·(cos θi + cos θo)/λ`.
//! - `P`: period of a lattice in µm, for each axis (`lattice.rs`); node j lies at `f = j/P`, and `p = f·P` is a
//!   position in nodes.
//! - `e_j = e_x(p_x − j_x)·e_y(p_y − j_y)`: interpolation weight of a node (`kernel.rs`).
//! - `P_j(κ)`, `D_j(κ)`: power and complex amplitude of a node ([`Spectrum`]).
//!
//! Both models of coherence interpolate over the nodes around p:
//! - *ensemble*: `S(f; κ) = norm · Σ_j e_j · P_j(κ)`,
//! - *patch*: `S(f; κ) = norm · |Σ_j e_j · D_j(κ)|²`.
//!
//! Where the tile repeats and the coherence window is of about its size, nodes are the diffraction orders `c_j`, and
//! `P_j = |c_j|²`, `D_j = c_j` without approximation. For a window much smaller than the tile, and for a scan that does
//! not repeat, `lattice.rs` picks another period, and the window is applied to the data beforehand (`spectrum.rs`).
//!
//! In κ each node is a cubic B-spline (`spline.rs`) of a quantity that stays finite as κ → 0 ([`SpectralTable`]).
//! Relative accuracy then survives at grazing angles, where the reflectance divides by w² = (cos θi + cos θo)².
//!
//! Stages of a build: [`BuildDemand`] predicts its cost, [`Spectrum`] computes node values at one κ, [`build()`] fits
//! the splines into a [`SpectralTable`], and [`PackedTable`] holds the form that evaluators read through [`TableView`].

mod band;
mod build;
mod coherence;
mod error;
mod estimate;
mod kernel;
mod lattice;
mod lookup;
mod packed;
mod progress;
mod spectrum;
mod spline;
mod view;

pub use build::{Built, DENSITY_FLOOR_UM2, TableReport, build};
pub use coherence::CoherenceWindow;
pub use error::TableError;
pub use estimate::{BUILD_LIMIT, BuildDemand, Estimate, LIMIT_BYTES, LIMIT_SECONDS, Purpose};
pub use kernel::InterpolationKernel;
pub use lattice::{Lattice, LatticeAxis};
pub(crate) use lookup::PowerCurves;
pub use lookup::{HEADER, NodeCurve, NodeQuantity, SpectralTable};
pub use packed::{Format, PackedLayout, PackedTable};
pub use progress::{Progress, Steps};
pub use spectrum::{Model, Spectrum, Tiling};
pub(crate) use spectrum::{lag_grid, taper};
pub use view::TableView;

/// Shortest tabulated wavelength in nm, the lower end of Mitsuba's spectra (`MI_CIE_MIN`).
pub const WAVELENGTH_MIN_NM: f64 = 360.0;
/// Longest tabulated wavelength in nm, the upper end of Mitsuba's spectra (`MI_CIE_MAX`).
pub const WAVELENGTH_MAX_NM: f64 = 830.0;
/// Largest tabulated spatial frequency `2/λ` along one axis, in cycles/µm: `|wi + wo| ≤ 2` at the shortest wavelength.
pub const FREQUENCY_MAX_PER_UM: f64 = 2e3 / WAVELENGTH_MIN_NM;
/// Accepted coherence lengths in µm. Chosen: far beyond any light and any relief at both ends.
pub const COHERENCE_LENGTH_UM: std::ops::RangeInclusive<f64> = 1e-3..=1e5;
/// Accepted relative errors of the tables. Chosen: rounding to single precision limits the lower end.
pub const TOLERANCE: std::ops::RangeInclusive<f64> = 1e-6..=0.1;
