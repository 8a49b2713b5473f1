//! Rigorous diffraction by one grating: Maxwell's equations for a relief that varies along x alone.
//!
//! Above the relief is air; below it a perfect conductor, a metal or a dielectric.
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
//! # Symbols
//!
//! Time goes as e^{−iωt}; lengths are in µm, wave numbers in rad/µm, wavelengths in nm; the impedance of vacuum is 1.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | x, y, z | across the grooves, along the grooves, upwards |
//! | d | period of the relief |
//! | k = 2π/λ | wave number in vacuum |
//! | n | refractive index of the lower medium, eta + ik |
//! | ky | wave number along y, common to all fields: each goes as e^{i·ky·y} |
//! | κ² = k² − ky² | squared wave number in the xz plane, in the air |
//! | κm² = k²n² − ky² | the same in the lower medium |
//! | t = κd/2π | period in wavelengths of κ |
//! | b | Bloch phase: a field changes by e^{2πib} from one period to the next; in turns |
//! | m | index of a diffraction order |
//! | αm = 2π(b + m)/d | wave number of order m along x |
//! | βm = √(κ² − αm²) | wave number of order m along z; real where the order propagates, \|b + m\| < t |
//! | u | a field on the curve: Ey or Hy |
//! | ∂νu, ∂su | derivative of u along the normal ν, which points into the air, and along the curve |
//! | S, K | single and double layer of the Green's function of (∇² + κ²)G = −δ (`layers.rs`) |
//! | W | response of the lower medium: the matrix from u to ∂νu (`metal.rs`) |
//! | τ, node | parameter of the curve in [0, 2π), and its values at which fields are computed (`nodes.rs`) |
//!
//! # Equations
//!
//! Ey and Hy satisfy (∇² + κ²)u = 0, and so
//!
//! - in the air, `u/2 − K u + S ∂νu` is the incident wave;
//! - in the lower medium, `∂νu = W u` with `W = S⁻¹(½ + K)`, of the layers for κm.
//!
//! Continuity of the tangential fields couples Ey and Hy where ky ≠ 0, with Δ = 1/κ² − 1/κm²:
//!
//! - `∂νE = κ²[(n²/κm²) W E − (ky/k) Δ ∂sH]`,
//! - `∂νH = κ²[(1/κm²) W H + (ky/k) Δ ∂sE]`.
//!
//! Unknowns are Ey and Hy at the nodes of one period of the curve. One linear system is solved for all incident orders
//! at once. The integral equations are those of Kress, *Linear Integral Equations*, and Popov (ed.), *Gratings: Theory
//! and Numeric Applications*, ch. 12. Eliminating the lower medium by W and the coupling in these variables is derived
//! here.
//!
//! # Types
//!
//! - [`solve_orders`] answers one question: all orders for one direction and wavelength, with its checks.
//! - [`Discretisation`]: a [`Profile`] with nodes on it, for any wavelength and direction.
//! - [`Air`]: everything above the relief at one (t, b); it does not depend on the wavelength. [`Air::solve`] gives
//! - [`Amplitudes`]: the Jones matrices between all orders at one wavelength.
//! - [`MetalTable`]: W of one metal at one wavelength, for all directions.
//!
//! Everything runs on the caller's thread, with results that do not depend on other threads, to the bit.

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
pub use metal::{KY_SQUARED_RANGE, MetalTable};
pub use orders::{Estimate, Order, Orders, solve_orders, transverse_basis};
pub use profile::Profile;
