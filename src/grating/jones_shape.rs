//! Normalised Jones matrices of a grating's orders, called *shapes*. They vary more smoothly over incidences than the
//! power of an order, so a coarse table suffices. y is along the grooves, k = 2π/λ the wave number in vacuum, and ky
//! the component of a wave vector along y, equal for all orders (further symbols: `mod.rs`).

use sunbeam_fourier::num_complex::Complex64;

/// Smallest `|ky/k|` by which the crossed elements are divided. Division by smaller values would amplify the solver's
/// error. A larger bound makes the crossed elements of shapes too small at more incidences; near ky = 0 they are small
/// anyway.
const KY_RATIO_MIN: f64 = 0.02;
/// Smallest power of a matrix that is normalised, after the division by ky/k; below it the shape is zero. It is the
/// power of amplitudes of 1e-9 of the incident wave, far below the solver's error.
const POWER_MIN: f64 = 1e-18;

/// A Jones matrix between the two polarisation states of an order, `[EE, EH, HE, HH]`, the outgoing state first. In
/// state E the electric field has the component Ey along the grooves, and in state H the magnetic field has Hy.
///
/// The crossed elements EH and HE are divided by ky/k. They change their signs with ky, so the quotients are smooth
/// through ky = 0. The *power* of a matrix is half the sum of the squared magnitudes of its four elements. A shape is
/// scaled to power 1 after that division.
pub(super) type JonesShape = [Complex64; 4];

/// Shape of the Jones matrix `[[EE, EH], [HE, HH]]` at the ratio `ky²/k²`, which is negative for imaginary ky. The
/// matrix belongs to the principal root of ky²: ky ≥ 0, or ky = i·|ky|. The shape is zero for a matrix without power.
pub(super) fn jones_shape([[ee, eh], [he, hh]]: [[Complex64; 2]; 2], ky_squared_ratio: f64) -> JonesShape {
    let magnitude = ky_squared_ratio.abs().sqrt().max(KY_RATIO_MIN);
    let ky_ratio = if ky_squared_ratio < 0.0 { Complex64::new(0.0, magnitude) } else { Complex64::new(magnitude, 0.0) };
    let matrix = [ee, eh / ky_ratio, he / ky_ratio, hh];
    let power = 0.5 * matrix.iter().map(Complex64::norm_sqr).sum::<f64>();
    if power < POWER_MIN { [Complex64::ZERO; 4] } else { matrix.map(|element| element / power.sqrt()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_have_unit_power_on_both_sides_of_ky_zero() {
        let (ee, hh) = (Complex64::new(0.6, 0.1), Complex64::new(-0.3, 0.5));
        for ky_squared_ratio in [-0.2, -1e-30, 0.0, 1e-30, 0.7] {
            let shape = jones_shape([[ee, Complex64::ZERO], [Complex64::ZERO, hh]], ky_squared_ratio);
            let power = 0.5 * shape.iter().map(Complex64::norm_sqr).sum::<f64>();
            // 1e-14 is rounding.
            assert!((power - 1.0).abs() < 1e-14, "{ky_squared_ratio}: {shape:?}");
        }
        assert_eq!(jones_shape([[Complex64::ZERO; 2]; 2], 0.3), [Complex64::ZERO; 4]);
    }
}
