//! Maxwell's equations for one grating: a relief that varies along x alone, in air, above a metal, a perfect conductor or a
//! dielectric.
//!
//! ```
//! use sunbeam_rigorous::{Medium, Profile, solve_orders};
//!
//! // A sawtooth of 1.2 µm in aluminium, green light at 30° across the grooves.
//! let profile = Profile::blazed(1.2, 0.1)?;
//! let aluminium = Medium::index(0.96, 6.69)?;
//! let solved = solve_orders(&profile, &aluminium, 550.0, [0.5, 0.0, 0.75_f64.sqrt()])?;
//! let reflected: f64 = solved.orders.iter().map(|order| order.te()).sum();
//! assert!((reflected + solved.absorbed[0] - 1.0).abs() < 1e-3);
//! # Ok::<(), sunbeam_rigorous::Error>(())
//! ```
//!
//! # The problem
//!
//! Time goes as e^{−iωt}, lengths are in µm, wavelengths in nm, the impedance of vacuum is 1. z is up, the normal ν points into the
//! air, and the curve runs along +x where it is flat. All fields go as e^{i·ky·y}, and from period to period as a phase. In the air
//! κ² = k² − ky², below κm² = k²n² − ky². Ey and Hy satisfy (∇² + κ²)u = 0, and with layers S and K of the Green's
//! function of (∇² + κ²)G = −δ
//!
//! - in the air `u/2 − K u + S ∂νu` is the incident wave,
//! - below, `∂νu = W u` with `W = S⁻¹(½ + K)` of its own layers.
//!
//! Continuity of the tangential fields couples the two where light does not fall across the grooves, with δ = 1/κ² − 1/κm²:
//!
//! - `∂νE = κ²[(n²/κm²) W E − (ky/k) δ ∂sH]`,
//! - `∂νH = κ²[(1/κm²) W H + (ky/k) δ ∂sE]`.
//!
//! The boundary integral equations are those of Kress, *Linear Integral Equations*, and Popov (ed.), *Gratings: Theory and
//! Numeric Applications*, ch. 12; eliminating the lower medium by W and the coupling in these variables is worked out
//! here. Unknowns are Ey and Hy at the nodes: a system of twice as many, for all incident orders at once.
//!
//! # Where what is
//!
//! A [`Profile`] with its nodes is a [`Discretisation`]. Its [`Air`] at (t, b), t = κd/2π and b the phase in turns, does not
//! depend on the wavelength; [`Air::solve`] gives the [`Amplitudes`] of all orders for one. A [`MetalTable`] is a metal's W at
//! one wavelength for all directions. [`solve_orders`] puts these together for one question. Everything runs on the
//! caller's thread, and gives the same bytes there however many run beside it.

mod air;
mod amplitudes;
mod discretisation;
mod error;
mod interpolation;
mod lattice_sum;
mod layers;
mod limits;
mod linear;
mod medium;
mod metal;
mod nodes;
mod orders;
mod profile;
mod special;

pub use air::Air;
pub use amplitudes::{Amplitudes, Jones};
pub use discretisation::{Discretisation, Resolution};
pub use error::Error;
pub use limits::check_size;
pub use medium::Medium;
pub use metal::MetalTable;
pub use orders::{Estimate, Order, Orders, solve_orders, transverse_basis};
pub use profile::Profile;
