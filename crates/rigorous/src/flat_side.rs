//! The flat lower side of a film: a boundary between the medium, above, and air, below. Light passes it once; what the
//! side reflects is left out.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | x, y, z | across the grooves of the film's relief, along them, and up |
//! | k | wave number in vacuum |
//! | K | tangential wave vector (Kx, Ky) over k; equal on both sides; K² = Kx² + Ky² |
//! | c1, cn | normal components of the wave vector over k in the air and in the medium, positive |
//! | n, ε | index of the medium, and n² |
//! | d | unit vector along which the wave travels |
//! | Ds, Dp | c1 + cn, and ε·c1 + cn |
//! | ts, tp | amplitudes across and in the plane of incidence, 2√(c1·cn)/Ds and 2n√(c1·cn)/Dp; \|t\|² is a power |
//!
//! Jones matrices are between the states without Hy and without Ey (`orders.rs`). The unit vectors a, in the air, and
//! b, in the medium, are the light polarised across the plane of incidence, in components of these states. U is the
//! rotation that maps b to a. The Jones matrix is `tp·U + (ts − tp)·a bᵀ`: it multiplies the part of the light along b
//! by ts and the part orthogonal to b by tp, and turns both from the medium's basis to that of the air.
//!
//! The components of a and b have the denominator |K|·√(1 − d.y²). The elements of U and of `a bᵀ` therefore have the
//! factor 1/K². The code cancels it, by the identities in its comments. The results are finite for K = 0 and analytic
//! in Ky, so they also hold for imaginary Ky.

use crate::{Jones, Order};
use num_complex::Complex64;

/// Jones matrix of the flat side, `[state in the air][state in the medium]`, for a wave with the tangential wave vector
/// (`k_x`, `k_y`) over k, in a medium of index `eta`. `normals` are c1 and cn. `is_downwards` tells the direction of
/// the light. The layout is the same for both: light that goes up, from the air, is multiplied by the transpose.
pub(crate) fn passage(eta: f64, k_x: f64, k_y: Complex64, [c1, cn]: [f64; 2], is_downwards: bool) -> Jones {
    let eps = eta * eta;
    // The wave vectors over k have the z components −sign·c1 and −sign·cn.
    let sign = if is_downwards { 1.0 } else { -1.0 };
    let (d_s, d_p, root) = (c1 + cn, eps * c1 + cn, (c1 * cn).sqrt());
    // Product of √(1 − d.y²) in the air and in the medium, which divides all elements.
    let y_squared = k_y * k_y;
    let norm = ((1.0 - y_squared) * (1.0 - y_squared / eps)).sqrt();
    let k_squared = k_x * k_x + y_squared;
    // Scalar product of a and b times `norm`, (Kx² + Ky²·c1·cn/n)/K², by (c1·cn/n)² − 1 = K²(K²/ε − 1 − 1/ε).
    let cosine = 1.0 + y_squared * (k_squared / eps - 1.0 - 1.0 / eps) / (c1 * cn / eta + 1.0);
    // Sine of the angle of U times `norm`, sign·Kx·Ky(cn/n − c1)/K², by (cn/n)² − c1² = K²(ε − 1)/ε.
    let sine = k_y * (sign * k_x * (eps - 1.0) / (eta * (eta * c1 + cn)));
    let t_p = 2.0 * eta * root / d_p;
    // (ts − tp)/K², by 1/Ds − n/Dp = (n − 1)(n·c1 − cn)/(Ds·Dp) and (n·c1)² − cn² = −K²(ε − 1).
    let difference = -2.0 * root * (eta - 1.0) * (eps - 1.0) / (d_s * d_p * (eta * c1 + cn));
    // a and b times their denominators.
    let air = [Complex64::from(k_x), k_y * (sign * c1)];
    let medium = [Complex64::from(k_x), k_y * (sign * cn / eta)];
    let rotation = [[cosine, sine], [-sine, cosine]];
    [0, 1].map(|out| [0, 1].map(|within| (rotation[out][within] * t_p + air[out] * medium[within] * difference) / norm))
}

/// Product of two Jones matrices.
pub(crate) fn multiply(a: &Jones, b: &Jones) -> Jones {
    [0, 1].map(|i| [0, 1].map(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
}

impl Order {
    /// The order after the flat lower side of a film of index `eta`, in the air below it; `None` where that side
    /// reflects the order totally. `self` is an order in the medium: its direction has negative z.
    ///
    /// ```
    /// use sunbeam_rigorous::{Profile, solve_both_sides};
    ///
    /// // At 550 nm, order −2 would have the sine −1.1 in air: it is trapped.
    /// let solved = solve_both_sides(&Profile::sinusoid(1.0, 0.2)?, 1.5, 550.0, [0.0, 0.0, 1.0])?;
    /// let is_trapped = |index: i32| {
    ///     let order = solved.below.iter().find(|order| order.index == index).expect("it propagates");
    ///     order.through_flat_side(1.5).is_none()
    /// };
    /// assert!(is_trapped(-2) && !is_trapped(1));
    /// # Ok::<(), sunbeam_rigorous::Error>(())
    /// ```
    pub fn through_flat_side(&self, eta: f64) -> Option<Self> {
        let inside = self.direction;
        let [x, y] = [inside[0] * eta, inside[1] * eta];
        let c1_squared = 1.0 - x * x - y * y;
        if c1_squared <= 0.0 {
            return None;
        }
        let (c1, cn) = (c1_squared.sqrt(), -inside[2] * eta);
        let jones = multiply(&passage(eta, x, y.into(), [c1, cn], true), &self.jones);
        Some(Self { index: self.index, direction: [x, y, -c1], jones })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Components of the states without Hy and without Ey along the states s and p, across and in the plane of
    /// incidence: `[s, p][without Hy, without Ey]`, for the direction `d`, whose y may be imaginary.
    fn components(d: [Complex64; 3]) -> Jones {
        let sine = (d[0] * d[0] + d[1] * d[1]).sqrt();
        let zero = Complex64::ZERO;
        let s = [-d[1] / sine, d[0] / sine, zero];
        let p = [s[1] * d[2], -s[0] * d[2], s[0] * d[1] - s[1] * d[0]];
        // The states of `transverse_basis`, which takes real directions only.
        let across = (d[0] * d[0] + d[2] * d[2]).sqrt();
        let first = [-d[1] * d[0] / across, across, -d[1] * d[2] / across];
        let second = [d[2] / across, zero, -d[0] / across];
        [s, p].map(|state| [first, second].map(|basis| (0..3).map(|c| basis[c] * state[c]).sum()))
    }

    #[test]
    fn matrices_have_fresnel_amplitudes_across_and_in_the_plane_of_incidence() {
        /// Rounding of a few dozen operations.
        const ROUNDING: f64 = 1e-12;
        for eta in [1.2, 1.5, 2.5] {
            for (k_x, k_y) in [
                (0.5, Complex64::from(0.3)),
                (-0.2, Complex64::from(0.9)),
                (1e-3, Complex64::from(-2e-3)),
                (0.4, Complex64::new(0.0, 0.2)),
                (-0.1, Complex64::new(0.0, 0.7)),
            ] {
                let squared = (k_x * k_x + k_y * k_y).re;
                let (c1, cn) = ((1.0 - squared).sqrt(), (eta * eta - squared).sqrt());
                for (is_downwards, sign) in [(true, -1.0), (false, 1.0)] {
                    let [air, medium] = [(c1, 1.0), (cn, eta)].map(|(normal, index)| {
                        components([Complex64::from(k_x), k_y, Complex64::from(sign * normal)].map(|c| c / index))
                    });
                    let root = 2.0 * (c1 * cn).sqrt();
                    let amplitudes = [root / (c1 + cn), eta * root / (eta * eta * c1 + cn)];
                    let found = passage(eta, k_x, k_y, [c1, cn], is_downwards);
                    for (out, within) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        let expected: Complex64 =
                            (0..2).map(|state| air[state][out] * medium[state][within] * amplitudes[state]).sum();
                        let difference = (found[out][within] - expected).norm();
                        assert!(difference < ROUNDING, "{eta} {k_x} {k_y} {out} {within}: {found:?} {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn matrices_are_finite_at_normal_incidence_and_near_it() {
        let at = |k_x: f64, k_y: Complex64| {
            let squared = (k_x * k_x + k_y * k_y).re;
            passage(1.5, k_x, k_y, [(1.0 - squared).sqrt(), (2.25 - squared).sqrt()], true)
        };
        // In the third case K² is zero, but Kx is not.
        for (k_x, k_y) in [(0.0, Complex64::ZERO), (1e-9, Complex64::from(1e-9)), (0.3, Complex64::new(0.0, 0.3))] {
            let [[ee, eh], [he, hh]] = at(k_x, k_y);
            // Both states of a plane of incidence have the amplitude 2√n/(1 + n) at K = 0. Its square is 0.96.
            let determinant = ee * hh - eh * he;
            assert!((determinant - 0.96).norm() < 1e-6, "{k_x} {k_y}: {determinant}");
        }
    }
}
