//! Special functions: Chebyshev series, exponential integral, Faddeeva function (a scaled complementary error function
//! of a complex number), and tables of Hankel and Bessel functions over the distance.

mod chebyshev;
mod expint;
mod faddeeva;
mod radial;

pub(crate) use chebyshev::{chebyshev_coefficients, chebyshev_nodes};
pub(crate) use expint::expint_1;
pub(crate) use faddeeva::faddeeva;
pub(crate) use radial::Radial;

/// Euler's constant γ.
pub(crate) const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;
