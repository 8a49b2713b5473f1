//! Transforms of the phase screen `exp(iκh)` over a tile (docs/model.md#the-phase-screen).
//!
//! - [`OrderTransform`]: every order amplitude `c_j(κ)` of one κ by FFT, in double precision.
//! - [`Expansion`]: DFTs that depend on neither direction nor wavelength, from which `c_j(κ)` follows for any κ;
//!   Chebyshev (Jacobi–Anger) or, as Single 2014 has it, Taylor. [`TermTransform`] gives them one at a time.
//! - [`naive_order_amplitude`]: the direct sum, the oracle that judges the rest.
//! - [`periods`]: the dominant periods of the heights themselves.
//!
//! All use the positive exponent, the mean over the tile (so `Σ|c_j|² = 1`), and FFT order of bins.

mod expansion;
mod naive;
mod periods;
mod screen;

pub use expansion::{Expansion, Series, TermTransform, chebyshev_terms, taylor_terms};
pub use naive::naive_order_amplitude;
pub use periods::{Period, Periods, periods};
pub use screen::OrderTransform;
pub use sunbeam_fourier::{Direction, Fft2, Precision};
