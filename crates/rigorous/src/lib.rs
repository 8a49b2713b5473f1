//! Rigorous diffraction by one grating: Maxwell's equations for a relief that varies along x alone.
//!
//! Air lies above the relief; below it lies a perfect conductor, a metal or a dielectric.
//!
//! ```
//! use sunbeam_rigorous::{Medium, Profile, solve_orders};
//!
//! // A sawtooth of period 1.2 µm and height 0.1 µm in aluminium; green light at 30° across the grooves.
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
//! Fields vary in time as e^{−iωt}. Lengths are in µm, wave numbers in rad/µm, wavelengths in nm. The impedance of
//! vacuum is 1.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | x, y, z | across the grooves, along the grooves, upwards |
//! | d | period of the relief |
//! | k = 2π/λ | wave number in vacuum |
//! | n | refractive index of the lower medium, `eta + i·k` (this k is the extinction coefficient) |
//! | ky | wave number along y, common to all fields: each varies as e^{i·ky·y} |
//! | κ² = k² − ky² | squared wave number in the xz plane, in the air |
//! | κm² = k²n² − ky² | the same in the lower medium, which m stands for in κm and tm |
//! | t = κd/2π, tm = κm·d/2π | period in units of the wavelengths 2π/κ and 2π/κm |
//! | b | Bloch phase in turns: a field changes by the factor e^{2πib} from one period to the next |
//! | m | index of a diffraction order |
//! | αm = 2π(b + m)/d | wave number of order m along x |
//! | βm = √(κ² − αm²) | wave number of order m along z; real where the order propagates, \|b + m\| < t |
//! | curve | cross-section of the relief in the xz plane |
//! | u | a field on the curve: Ey or Hy |
//! | ∂νu, ∂su | derivatives of u along the normal ν, which points into the air, and along the curve towards rising τ |
//! | S, K | single and double layer potential of the Green's function G, with (∇² + κ²)G = −δ (`layers.rs`) |
//! | W | response of the lower medium: the matrix from u to ∂νu (`metal.rs`) |
//! | τ | parameter of the curve, 0 to 2π over one period |
//! | node | a value of τ at which fields are computed (`nodes.rs`) |
//!
//! # Equations
//!
//! Ey and Hy satisfy (∇² + κ²)u = 0 in the air and (∇² + κm²)u = 0 in the lower medium. Green's formula gives
//!
//! - in the air, `u/2 − K u + S ∂νu` = incident wave, with S and K for κ;
//! - in the lower medium, `∂νu = W u` with `W = S⁻¹(½ + K)`, with S and K for κm.
//!
//! Each ∂νu is taken on the side of its own medium; u is continuous. Continuity of the other tangential components, Ex
//! and Hx on a flat surface, gives ∂νu in the air from the fields on the curve. It couples Ey and Hy where ky ≠ 0, with
//! Δ = 1/κ² − 1/κm²:
//!
//! - `∂νEy = κ²[(n²/κm²) W Ey − (ky/k) Δ ∂sHy]`,
//! - `∂νHy = κ²[(1/κm²) W Hy + (ky/k) Δ ∂sEy]`.
//!
//! For light that is incident from the lower medium with the field u₀, `W u` is replaced by `W u + ∂νu₀ − W u₀`. On a
//! perfect conductor Ey and ∂νHy vanish instead.
//!
//! Unknowns are Ey and Hy at the nodes of one period of the curve. One linear system is solved for all incident orders
//! at once. The integral equations are those of Kress, *Linear Integral Equations*, and Popov (ed.), *Gratings: Theory
//! and Numeric Applications*, ch. 12. The elimination of the lower medium by W and the form of the coupling are not
//! taken from them.
//!
//! # Types
//!
//! - [`solve_orders`]: all orders for one direction and wavelength, with checks of power balance and reciprocity.
//! - [`Discretisation`]: a [`Profile`] with nodes on it, for any wavelength and direction.
//! - [`Air`]: layer potentials and plane waves above the relief at one (t, b), for any wavelength and lower medium.
//! - [`Amplitudes`]: the Jones matrices between all orders at one wavelength, the result of [`Air::solve`].
//! - [`solve_both_sides`]: all orders on both sides of a lossless dielectric, for light from either side.
//! - [`Below`]: a dielectric below the relief at one (tm, b), for any wavelength.
//! - [`Scattering`]: the Jones matrices between all orders on both sides, the result of [`Air::scatter`].
//! - [`MetalTable`]: W of one metal at one wavelength, for all directions.
//!
//! All functions run on the caller's thread. Their results are identical to the bit, however many threads call them.

mod air;
mod amplitudes;
mod both_sides;
mod discretisation;
mod error;
mod flat_side;
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
mod scattering;
mod special;
mod waves;

pub use air::Air;
pub use amplitudes::{Amplitudes, Jones};
pub use both_sides::{BothSides, solve_both_sides};
pub use discretisation::{Discretisation, Resolution};
pub use error::Error;
pub use limits::check_size;
pub use medium::Medium;
pub use metal::{KY_SQUARED_RANGE, MetalTable};
pub use orders::{CHECK_TOLERANCE, Estimate, Order, Orders, solve_orders, transverse_basis};
pub use profile::Profile;
pub use scattering::{Below, Channel, Scattering, Side};
