//! The flat lower side of a film: a boundary between the medium, above, and air, below. Light passes it once.
//!
//! | symbol | meaning |
//! | --- | --- |
//! | K | wave vector over k; Kx and Ky are equal on both sides |
//! | c1, cn | normal components of K in the air and in the medium, positive |
//! | τs, τp | transmittances for the states across and in the plane of incidence, 4c1·cn/s² and 4ε·c1·cn/p² |
//! | s, p | c1 + cn, and ε·c1 + cn, with ε = n² |
//!
//! The power that a field passes on is a quadratic form of its amplitudes v of the states without Hy and without Ey,
//! `vᵀ M v*`. With q² = 1 − Ky²/ε and the vector w = (Kx, ±Ky·cn/n), positive for light that travels downwards,
//! `M = τp + (τs − τp)·w wᵀ/(q²·(Kx² + Ky²))`. The quotient `(τs − τp)/(Kx² + Ky²) = −4c1·cn·(ε − 1)²/(s p)²` is
//! finite, so M is analytic in Ky. This serves the continuation to imaginary ky.

use crate::{Jones, Order, transverse_basis};
use num_complex::Complex64;

/// The form M of a wave with the tangential wave vector (`k_x`, `k_y`) over k, in a medium of index `eta`. `normals`
/// are c1 and cn.
pub(crate) fn transmitted_form(
    eta: f64,
    k_x: f64,
    k_y: Complex64,
    [c1, cn]: [f64; 2],
    is_downwards: bool,
) -> [[Complex64; 2]; 2] {
    let eps = eta * eta;
    let (s, p) = (c1 + cn, eps * c1 + cn);
    let of_p = Complex64::from(4.0 * eps * c1 * cn / (p * p));
    let slope = -4.0 * c1 * cn * (eps - 1.0).powi(2) / (s * p).powi(2);
    let sign = if is_downwards { 1.0 } else { -1.0 };
    let w = [Complex64::from(k_x), k_y * (sign * cn / eta)];
    let scale = slope / (1.0 - k_y * k_y / eps);
    [[of_p + scale * w[0] * w[0], scale * w[0] * w[1]], [scale * w[1] * w[0], of_p + scale * w[1] * w[1]]]
}

impl Order {
    /// The order after the flat lower side of a film of index `eta`, in the air below it; `None` where that side
    /// reflects the order totally. The direction of the order is one within the medium, with negative z.
    ///
    /// ```
    /// use sunbeam_rigorous::{Profile, solve_both_sides};
    ///
    /// // Order 2 of 550 nm has the sine 1.1 in air, and is trapped.
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
        let outside = [x, y, -c1];
        let scale = (4.0 * c1 * cn).sqrt();
        let amplitudes = [scale / (c1 + cn), eta * scale / (eta * eta * c1 + cn)];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        // Components along the states across and in the plane of incidence: `[state of the plane][state of the
        // grooves]`.
        let components = |d: [f64; 3]| {
            let sine = d[0].hypot(d[1]);
            let s = if sine < SINE_MIN { [0.0, 1.0, 0.0] } else { [-d[1] / sine, d[0] / sine, 0.0] };
            let p = [s[1] * d[2], -s[0] * d[2], s[0] * d[1] - s[1] * d[0]];
            let basis = transverse_basis(d);
            [s, p].map(|state| basis.map(|e| dot(e, state)))
        };
        let (before, after) = (components(inside), components(outside));
        let passed = |out: usize, within: usize| -> f64 {
            (0..2).map(|state| after[state][out] * amplitudes[state] * before[state][within]).sum()
        };
        let jones: Jones = [0, 1]
            .map(|out| [0, 1].map(|from| (0..2).map(|within| self.jones[within][from] * passed(out, within)).sum()));
        Some(Self { index: self.index, direction: outside, jones })
    }
}

/// Sine with the normal below which the plane of incidence is taken to be that across the grooves: both states have the
/// same transmittance there.
const SINE_MIN: f64 = 1e-9;
