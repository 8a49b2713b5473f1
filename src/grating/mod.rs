//! Gratings by Maxwell's equations: reliefs that vary along x alone (docs/model.md#gratings-by-maxwells-equations).
//!
//! `sunbeam-rigorous` solves the orders of one grating at one incidence and wavelength. [`GratingSurface`] tabulates
//! their unpolarised efficiencies over all incidences and wavelengths. Its reflectance `f_r = Σ_m e_m K(f − f_m)/λ²` is
//! reciprocal, conserves energy without a correction, and includes the material's reflectance. [`GratingColourSurface`]
//! is the reflectance integrated over the visible wavelengths to linear sRGB. [`JonesTable`] adds polarisation.
//!
//! # Symbols
//!
//! | symbol | meaning |
//! | --- | --- |
//! | d | period in µm; the relief varies along x, its grooves run along y |
//! | λ, ν = 1/λ | wavelength; wavenumber in 1/µm |
//! | wi, wo | unit vectors to the light and to the viewer |
//! | f = (wi + wo)_xy/λ | frequency of a pair of directions in cycles/µm |
//! | m | index of an order; its frequency is `f_m = (m/d, 0)` |
//! | e_m | efficiency: fraction of the unpolarised incident power in order m |
//! | K, σ | Gaussian of an order over frequencies, by the coherence window, of integral 1; its deviation in cycles/µm |
//! | y | component of a direction along the grooves; \|ky/k\| is \|y\| in air and n·\|y\| in a medium |
//! | ky/k | wave vector along the grooves over k = 2π/λ, equal for all orders: −wi.y, or wo.y of an order |
//! | n | refractive index of the medium below an interface |
//! | t = (d/λ)·√(1 − ky²/k²) | bound of \|a + m\| for orders that propagate in air |
//! | tm = (d/λ)·√(n² − ky²/k²) | the same in the medium below an interface |
//! | a = −(d/λ)·wi.x | wave number of the incident wave along x, in units of 2π/d; that of order m is `a + m` |
//! | b | Bloch phase in turns: `a` up to an integer, common to all orders |
//! | cell | region of the plane (t, a) between the lines of whole t − a and t + a, at which an order appears |
//! | s = ⌊t − a⌋ + ⌊t + a⌋ | index of the cell: number of propagating orders minus one |
//! | p, q | fractional parts of `t − a` and `t + a`: position within the cell |
//! | order number | place of an order among the propagating ones, 0 to s, by ascending m |
//! | channel | an order on one side of the relief, which light may arrive in or leave in |
//! | Ey, Hy | the two polarisation states of an order, by the field along the grooves |
//! | point (t, b) | one solution of `sunbeam-rigorous`, for all orders at once |
//! | node | a position in a cell's table or in its solution; also a place on the profile at which fields are solved |
//!
//! A pair of directions rarely fulfils the grating equation exactly. For each order m, lobes move both directions by
//! half of the distance to the order, and take t and a of the moved incident direction (`lobe.rs`).
//!
//! Evaluators are generic over `N: Numbers`: an `N::Real` is one number, a SIMD vector or a traced variable.
//!
//! t, b and the index m are those of `sunbeam-rigorous`, which solves at given t, b and λ. From t and λ follows
//! `ky²/k² = 1 − (tλ/d)²`, so ky is imaginary at wavelengths above d/t. Components of a direction in a medium of
//! index n enter f, a and ky/k times n.
//!
//! # Files
//!
//! | file | contents |
//! | --- | --- |
//! | `body.rs` | the kind of body below the relief |
//! | `cell_position.rs` | from a wave's t and a to its cell |
//! | `channels.rs` | orders on either side of the relief at one wave |
//! | `layout.rs` | cells of a table, and the body below its relief |
//! | `efficiencies.rs`, `build.rs` | the table of efficiencies: look-up, and build from solved points |
//! | `chebyshev.rs` | nodes at which a cell is solved, and resampling to the table's nodes |
//! | `plan.rs`, `wavelengths.rs` | numbers of nodes and wavelengths of a table; cost of its build |
//! | `order_solver.rs`, `rigorous_solver.rs` | traits of the solvers behind the tables, and the solver of reflectors |
//! | `dielectric_solver.rs`, `film_solver.rs` | the solver of both sides of a dielectric, and that of a film |
//! | `interface_solver.rs`, `interface_table.rs` | interfaces: the solver of their cells, the build of their tables |
//! | `lobe.rs`, `surface.rs` | the lobe at wavelengths and the surface that owns its table |
//! | `colour_tables.rs`, `colour_lobe.rs`, `colour_surface.rs` | tables, lobe and surface in linear sRGB |
//! | `jones_shape.rs`, `jones_table.rs`, `polarisation.rs` | Jones matrices of orders, their table, Mueller matrices |
//! | `exact.rs` | reference without tables |
//! | `profile.rs` | profiles of presets and height fields |
//! | `error.rs` | errors of solving and tabulating |

mod body;
mod build;
mod cell_position;
mod channels;
mod chebyshev;
mod colour_lobe;
mod colour_surface;
mod colour_tables;
mod dielectric_solver;
mod efficiencies;
mod error;
mod exact;
mod film_solver;
mod interface_solver;
mod interface_table;
#[cfg(test)]
mod interface_tests;
mod jones_shape;
mod jones_table;
mod layout;
mod lobe;
mod order_solver;
mod plan;
mod polarisation;
mod profile;
mod rigorous_solver;
mod surface;
mod wavelengths;

// Constants for a test that compares them with their WGSL twins, here and below.
#[cfg(test)]
pub(crate) use crate::numeric::math::GAUSSIAN_REACH;
pub use body::GratingBody;
pub use build::GratingReport;
pub use colour_lobe::GratingColourLobe;
pub use colour_surface::GratingColourSurface;
pub use colour_tables::ColourTables;
#[cfg(test)]
pub(crate) use colour_tables::{DIVISOR_MIN, NU_HALF, NU_MIDDLE, ORDER_ZERO_NODES, TAU_SCALE, WEIGHT_NODES};
#[cfg(test)]
pub(crate) use efficiencies::UNIT;
pub use error::GratingError;
pub use exact::ExactGrating;
pub use jones_table::JonesTable;
pub use layout::{Below, EfficiencyLayout, InterfaceCells};
pub use lobe::{GratingLayout, GratingLobe};
pub use polarisation::JonesView;
pub use profile::{preset_profile, profile_of};
pub use sunbeam_rigorous::{Medium, Order, Profile, Side, check_size, solve_both_sides, solve_orders};
pub use surface::GratingSurface;
