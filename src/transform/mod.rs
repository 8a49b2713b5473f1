//! Fourier transforms of the phase screen `exp(iκh)` over a tile (docs/model.md#the-phase-screen).
//!
//! | symbol | meaning |
//! | --- | --- |
//! | h | height in µm |
//! | H | half the range of heights in µm |
//! | κ | phase rate in rad/µm: light gains the phase κh at the height h, with `κ = 2π(cosθi + cosθo)/λ` |
//! | λ, θi, θo | wavelength, and angles from the normal of the light's arrival and exit |
//! | j = (jx, jy) | diffraction order of the tile, which is Lx by Ly µm large |
//! | c_j(κ) | order amplitude: mean over the tile of `exp(iκh)·exp(+2πi(jx·x/Lx + jy·y/Ly))` |
//!
//! The powers of all orders sum to one, `Σ|c_j|² = 1`. Arrays of order amplitudes are row-major `[jy][jx]` in FFT
//! order: 0, 1, 2, … and then the negative orders up to −1.
//!
//! - [`OrderTransform`]: all `c_j(κ)` of one κ by FFT, in double precision.
//! - [`Expansion`]: transforms of powers or Chebyshev polynomials of h, from which `c_j(κ)` follows for any κ.
//! - [`TermTransform`]: the transforms of an [`Expansion`], one term at a time.
//! - [`naive_order_amplitude`]: the direct sum, the reference for all others.
//! - [`periods`]: the dominant periods of the heights.
//!
//! ```
//! use sunbeam::Preset;
//! use sunbeam::transform::{OrderTransform, naive_order_amplitude};
//!
//! let field = Preset::Blazed.build(None, None)?;
//! let kappa = 20.0;
//! let amplitudes = OrderTransform::new(&field).amplitudes(kappa);
//! // Phases differ, since the transform measures heights from the middle of their range.
//! let direct = naive_order_amplitude(&field, kappa, 1, 0);
//! assert!((amplitudes[1].norm() - direct.norm()).abs() < 1e-12);
//! # Ok::<(), sunbeam::height_field::HeightFieldError>(())
//! ```

mod expansion;
mod naive;
mod periods;
mod screen;

pub use expansion::{Expansion, Series, TermTransform, chebyshev_terms, taylor_terms};
pub use naive::naive_order_amplitude;
pub use periods::{Period, Periods, periods};
pub use screen::OrderTransform;
pub use sunbeam_fourier::{Direction, Fft2, Precision};
