//! Shapes of Jones matrices: their form without their power, which varies smoothly enough to be tabulated.

use sunbeam_fourier::num_complex::Complex64;

/// Least `|ky/k|` by which the crossed elements are divided. Chosen: below it they are small, and the quotient would
/// amplify the solver's error.
const KY_MIN: f64 = 0.02;
/// Least power of a matrix that is normalised; below it the shape is zero. Chosen: far below the solver's rounding
/// (1e-12).
const POWER_MIN: f64 = 1e-18;

/// A Jones matrix of unit power between the states of Ey and of Hy: `[EE, EH, HE, HH]`, the outgoing state first.
///
/// The crossed elements EH and HE are divided by ky/k. They change their sign with ky, so their quotient is smooth
/// through zero.
pub(super) type JonesShape = [Complex64; 4];

/// Shape of the Jones matrix `[[EE, EH], [HE, HH]]` at the ratio `ky²/k²`, which may be negative; zero for a matrix
/// without power.
pub(super) fn jones_shape([[ee, eh], [he, hh]]: [[Complex64; 2]; 2], ky_squared_ratio: f64) -> JonesShape {
    let ky = Complex64::new(ky_squared_ratio, 0.0).sqrt();
    let ky = if ky.norm() < KY_MIN { ky * (KY_MIN / ky.norm().max(1e-12)) } else { ky };
    let matrix = [ee, eh / ky, he / ky, hh];
    let power = 0.5 * matrix.iter().map(Complex64::norm_sqr).sum::<f64>();
    if power < POWER_MIN { [Complex64::ZERO; 4] } else { matrix.map(|element| element / power.sqrt()) }
}
