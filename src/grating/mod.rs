//! Gratings by Maxwell's equations: reliefs that vary along x alone (docs/model.md#gratings-by-maxwells-equations).
//!
//! `sunbeam-rigorous` solves one grating at one incidence and wavelength. Here its orders become a table of unpolarised
//! efficiencies over all incidences and wavelengths ([`GratingSurface`]), and the table a reflectance
//! `f_r = Σ e_m K(f − f_m)/λ²`, which is reciprocal and keeps energy without a limit. What the material reflects is inside.

mod build;
mod colour_lobe;
mod colour_surface;
mod colour_tables;
mod efficiencies;
mod exact;
mod lobe;
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
pub use exact::ExactGrating;
#[cfg(test)]
pub(crate) use lobe::REACH;
pub use lobe::{GratingLayout, GratingLobe};
pub use polarisation::{JonesTable, JonesView};
pub use relief::{preset_profile, profile_of};
pub use sunbeam_rigorous::{Medium, Profile, check_size, solve_orders};
pub use surface::{GratingError, GratingSurface};
