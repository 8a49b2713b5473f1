//! Tables of the power spectrum `S(f; κ)` of a relief (docs/model.md#the-reflectance), and their look-up.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | `wi`, `wo`, `λ` | unit vectors from the surface to the light and the viewer; wavelength |
//! | `f = (u, v)/λ` | spatial frequency in cycles/µm, with `(u, v, w) = wi + wo`, w along the normal |
//! | `κ = 2πw/λ` | phase rate in rad per µm of height: heights h become phases κh |
//! | `exp(iκh)` | *phase screen* of the heights h; S is its power spectrum |
//! | `j = (jx, jy)` | node of the frequency lattice, at `(jx/Px, jy/Py)` with the periods Px and Py in µm |
//! | `p` | frequency in nodes, `(f.x·Px, f.y·Py)` |
//! | `e_j` | interpolation weight: product over both axes of [`InterpolationKernel::weight`] at the distance `p − j` |
//! | `P_j(κ)`, `D_j(κ)` | power and complex amplitude of node j, dimensionless |
//! | `norm` | factor in µm² that makes S a density over frequency |
//!
//! Light interferes only within the *coherence window*, a Gaussian on the surface. S depends on the model of coherence
//! ([`Model`]):
//!
//! - *ensemble*, the mean over all positions of the coherence window: `S(f; κ) = norm · Σ_j e_j · P_j(κ)`,
//! - *patch*, one fixed window: `S(f; κ) = norm · |Σ_j e_j · D_j(κ)|²`.
//!
//! The known rectangle of relief, the *tile*, repeats, or is a scan that does not ([`Tiling`]). A *native* lattice has
//! the tile's diffraction orders as nodes, a *resampled* one other frequencies (`lattice.rs`).
//!
//! Over κ each node is a cubic B-spline of a scaled quantity that stays finite as κ → 0 ([`SpectralTable`]). This keeps
//! the relative error small at grazing angles, where the reflectance divides by w². The spline consists of cubic
//! pieces, which meet at its *knots*. A node's *record* holds the coefficients of its spline.
//!
//! The files, in the order of a build:
//!
//! 1. `estimate.rs`: cost, and refusal of an expensive build with `advice.rs`
//! 2. `lattice.rs`, with `kernel.rs` and `band.rs`: the nodes
//! 3. `spectrum.rs`: values of all nodes at one κ
//! 4. `build.rs`, with `knots.rs` and `spline.rs`: splines over κ
//! 5. `spectral.rs`, with `node_curve.rs`: the table in single precision
//! 6. `packed.rs`, with `format.rs`: its 32-bit words
//! 7. `view.rs`: the look-up of evaluators
//!
//! Several of these files use `coherence.rs`, `error.rs` and `progress.rs`. Constants without another source were
//! chosen; most comments state the price of larger and smaller values. Evaluators are generic over the numbers
//! (`src/numeric`).

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
/// Largest spatial frequency `|f|` of any pair of directions, in cycles/µm: `|wi + wo| ≤ 2` divided by the shortest
/// wavelength.
pub const FREQUENCY_MAX_PER_UM: f64 = 2e3 / WAVELENGTH_MIN_NM;
/// Accepted coherence lengths in µm: four standard deviations of the coherence window. The range is wider than that of
/// useful values at both ends.
pub const COHERENCE_LENGTH_UM: RangeInclusive<f64> = 1e-3..=1e5;
/// Accepted relative errors of tables. Rounding to single precision limits the lower end; the upper end is chosen.
pub const TOLERANCE: RangeInclusive<f64> = 1e-6..=0.1;
