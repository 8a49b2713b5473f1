//! Gratings by Maxwell's equations: reliefs that vary along x alone (docs/model.md#gratings-by-maxwells-equations).
//!
//! `sunbeam-rigorous` solves one grating at one incidence and wavelength. Here the efficiencies of its orders are
//! tabulated over all incidences and wavelengths, and the tables become lobes. The reflectance `f_r = Σ_m e_m K(f −
//! f_m)/λ²` includes the material's, is reciprocal, and conserves energy without a limiter.
//!
//! | step | files |
//! | --- | --- |
//! | profile of a relief | `relief.rs` |
//! | coordinates `t`, `a` of an incidence, and cells between grazing orders | `place.rs` |
//! | efficiencies from the solver | `orders.rs`, `solved.rs` |
//! | table of efficiencies: wavelengths, nodes, layout | `wavelengths.rs`, `build.rs`, `efficiencies.rs` |
//! | lobe at wavelengths | `lobe.rs`, `surface.rs` |
//! | lobe in linear sRGB | `colour_tables.rs`, `colour_lobe.rs`, `colour_surface.rs` |
//! | Jones matrices of the orders | `polarisation.rs` |
//! | judge without tables | `exact.rs` |

mod build;
mod colour_lobe;
mod colour_surface;
mod colour_tables;
mod efficiencies;
mod error;
mod exact;
mod lobe;
mod orders;
mod place;
mod polarisation;
mod relief;
mod solved;
mod surface;
mod wavelengths;

pub use build::GratingReport;
pub use colour_lobe::GratingColourLobe;
pub use colour_surface::GratingColourSurface;
pub use colour_tables::ColourTables;
#[cfg(test)]
pub(crate) use colour_tables::{NU_HALF, NU_MIDDLE, ORDER_ZERO, SPREADS, TAU_SCALE, WEIGHTS};
pub use efficiencies::EfficiencyLayout;
#[cfg(test)]
pub(crate) use efficiencies::UNIT;
pub use error::GratingError;
pub use exact::ExactGrating;
#[cfg(test)]
pub(crate) use lobe::REACH;
pub use lobe::{GratingLayout, GratingLobe};
pub use polarisation::{JonesTable, JonesView};
pub use relief::{preset_profile, profile_of};
pub use sunbeam_rigorous::{Medium, Profile, check_size, solve_orders};
pub use surface::GratingSurface;
