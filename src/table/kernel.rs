//! Interpolation kernels: the weight of a lattice node at a distance, along one axis.
//!
//! - `P`: period of the lattice in µm. Nodes are frequencies `1/P` apart. Their values are the Fourier transform of
//!   data over lags (shifts in µm).
//! - `d`: distance between the frequency of a look-up and a node, in nodes (multiples of `1/P`).
//! - `e(d)`: weight of the node. A value between nodes is `Σ_j e(p − j) · value_j`, with `p` the position in nodes.
//! - *Taps*: the nodes that a look-up reads along an axis.
//! - `x`: lag in periods `P`.
//! - `ê(x) = ∫ e(d)·cos(2πd·x) dd`: transform of the kernel.
//! - *Images*: interpolation of discrete nodes repeats the data at the lags `x + n` for every whole number n, weighted
//!   by `ê(x + n)`. Data at the lag `x` are divided by `ê(x)` beforehand (`LatticeAxis::window`), so that the term n =
//!   0 is exact. The relative error that remains is `Σ_{n≠0} |ê(x + n)|/ê(x)`.
//! - `Λ = −ln(relative error)`: the log error for which a kernel is planned (`log_error`).

use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Number of quadrature points of the midpoint rule over the quarter turn in [`semicircle_integral`]. For ê(0) the rule
/// errs by `2r·e^−β·h²/24`, with `h` the step in radians: 1.2e-9 at the smallest β in use, 6.9 for three taps. More
/// points lengthen the build; half as many err four times as much.
const QUADRATURE_POINTS: usize = 512;

/// Weight `e(d)` of a node at the distance `d` in nodes.
///
/// ```
/// use sunbeam::table::InterpolationKernel;
///
/// let kernel = InterpolationKernel::Gaussian { sigma: 0.5 };
/// assert_eq!(kernel.weight(0.0), 1.0);
/// assert_eq!(kernel.weight(0.5), (-0.5f64).exp());
/// assert!((kernel.transform(0.0) - 0.5 * std::f64::consts::TAU.sqrt()).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum InterpolationKernel {
    /// `exp(−d²/(2σ²))`, the shape of a diffraction order under the coherence window. Exact where nodes are orders.
    Gaussian {
        /// Standard deviation σ in nodes.
        sigma: f64,
    },
    /// Exponential of a semicircle, `exp(β(√(1 − (d/r)²) − 1))` for `|d| < r`, zero elsewhere. No kernel of equal
    /// width has a transform that falls off much faster, so few taps suffice at a small oversampling
    /// (`OVERSAMPLING`).
    ///
    /// Barnett, Magland, af Klinteberg, *A parallel nonuniform fast Fourier transform library based on an "exponential
    /// of semicircle" kernel*, SIAM J. Sci. Comput. 41, 2019.
    Semicircle {
        /// β of the exponent, dimensionless.
        beta: f64,
        /// Radius r in nodes.
        radius: f64,
    },
}

impl InterpolationKernel {
    /// Weight `e(d)` at a distance in nodes; 1 at zero.
    pub fn weight(self, distance: f64) -> f64 {
        match self {
            Self::Gaussian { sigma } => (-0.5 * (distance / sigma).powi(2)).exp(),
            Self::Semicircle { beta, radius } => {
                let rest = 1.0 - (distance / radius).powi(2);
                if rest > 0.0 { (beta * (rest.sqrt() - 1.0)).exp() } else { 0.0 }
            }
        }
    }

    /// Transform `ê(x) = ∫ e(d)·cos(2πd·x) dd`; `x` is a lag in periods of the lattice. Like d, the result is in nodes.
    pub fn transform(self, x: f64) -> f64 {
        match self {
            Self::Gaussian { sigma } => TAU.sqrt() * sigma * (-0.5 * (TAU * sigma * x).powi(2)).exp(),
            Self::Semicircle { beta, radius } => semicircle_integral(beta, radius, |d| (TAU * d * x).cos()),
        }
    }

    /// Standard deviation `√(∫ d²·e(d) dd / ê(0))` in nodes.
    pub fn sigma(self) -> f64 {
        match self {
            Self::Gaussian { sigma } => sigma,
            Self::Semicircle { beta, radius } => {
                (semicircle_integral(beta, radius, |d| d * d) / self.transform(0.0)).sqrt()
            }
        }
    }
}

/// Integral over `|d| < r` of a semicircle's weight times an `even` function of `d`. With `d = r·sin φ` it is
/// `2r ∫₀^{π/2} exp(β(cos φ − 1))·cos φ·even(r·sin φ) dφ`.
fn semicircle_integral(beta: f64, radius: f64, even: impl Fn(f64) -> f64) -> f64 {
    let step = FRAC_PI_2 / QUADRATURE_POINTS as f64;
    let term = |i: usize| {
        let (sin, cos) = ((i as f64 + 0.5) * step).sin_cos();
        (beta * (cos - 1.0)).exp() * cos * even(radius * sin)
    };
    2.0 * radius * step * (0..QUADRATURE_POINTS).map(term).sum::<f64>()
}

/// Oversampling: period of a lattice over the largest lag of its data. A larger ratio takes more nodes in the table, a
/// smaller one more taps. At 2.5 instead of 3, with the best β for 5 to 8 taps, the images of a scan are two to five
/// times as strong. The constants of [`semicircle`] were fitted at 3.
pub(super) const OVERSAMPLING: f64 = 3.0;

/// Decrease of the natural logarithm of the images with each tap. Measured at [`OVERSAMPLING`] for the autocorrelation
/// of a tapered scan and for a Gaussian window. The test `images_stay_below_the_planned_error` repeats the
/// measurement.
const LOG_FALL_PER_TAP: f64 = 2.1;
/// Natural logarithm of the images at zero taps, the intercept of the fit: images are about
/// `exp(LOG_IMAGES_AT_ZERO_TAPS − LOG_FALL_PER_TAP·taps)`.
const LOG_IMAGES_AT_ZERO_TAPS: f64 = 0.6;
/// β of the semicircle per tap. 2.3 makes the images of 5 to 8 taps weakest in the measurement of
/// [`LOG_FALL_PER_TAP`]. At 2.1 they are two to three times as strong, at 2.5 two to thirteen times.
const BETA_PER_TAP: f64 = 2.3;

/// Semicircle kernel whose images stay below about `exp(−log_error)` on a lattice with [`OVERSAMPLING`], and its number
/// of taps. `log_error` is positive.
pub(super) fn semicircle(log_error: f64) -> (InterpolationKernel, usize) {
    let taps = ((log_error + LOG_IMAGES_AT_ZERO_TAPS) / LOG_FALL_PER_TAP).ceil();
    (InterpolationKernel::Semicircle { beta: BETA_PER_TAP * taps, radius: 0.5 * taps }, taps as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Gaussian, and semicircles for a large and a small error.
    fn kernels() -> [InterpolationKernel; 3] {
        [InterpolationKernel::Gaussian { sigma: 0.7 }, semicircle(9.0).0, semicircle(18.0).0]
    }

    /// `∫ e(d)·even(d) dd` by 20 000 midpoints from 0 to 12 nodes, doubled.
    fn midpoint_sum(kernel: InterpolationKernel, even: impl Fn(f64) -> f64) -> f64 {
        const STEPS: i32 = 20_000;
        let at = |i: i32| 12.0 * (f64::from(i) + 0.5) / f64::from(STEPS);
        (0..STEPS).map(|i| kernel.weight(at(i)) * even(at(i))).sum::<f64>() * 24.0 / f64::from(STEPS)
    }

    #[test]
    fn transforms_match_midpoint_sums() {
        for kernel in kernels() {
            for x in [0.0, 0.1, 0.33, 0.8, 1.2] {
                let (direct, transform) = (midpoint_sum(kernel, |d| (TAU * d * x).cos()), kernel.transform(x));
                // Error of the midpoints where the semicircle ends with a step of e^−β.
                assert!((direct - transform).abs() < 1e-7, "{kernel:?} {x}: {direct} {transform}");
            }
        }
    }

    #[test]
    fn variances_match_midpoint_sums() {
        for kernel in kernels() {
            let variance = midpoint_sum(kernel, |d| d * d) / midpoint_sum(kernel, |_| 1.0);
            // Error of the midpoints as above, weighted by d².
            assert!((kernel.sigma().powi(2) - variance).abs() < 1e-6, "{kernel:?}");
        }
    }

    #[test]
    fn images_stay_below_the_planned_error() {
        // Log errors of kernels with 5, 5, 6, 7 and 10 taps.
        for log_error in [8.0f64, 9.7, 11.8, 14.0, 18.7] {
            let (kernel, _) = semicircle(log_error);
            // Data over lags in units of the largest lag: the autocorrelation of a scan, and a Gaussian that falls to
            // the planned error.
            let gaussian = |lag: f64| (-log_error * lag * lag).exp();
            for (name, data) in [("scan", &tapered_scan as &dyn Fn(f64) -> f64), ("window", &gaussian)] {
                let worst = (0..=50)
                    .map(|i| f64::from(i) / 50.0)
                    .map(|lag| {
                        let x = lag / OVERSAMPLING;
                        // Images further away are much weaker.
                        let images: f64 = (1..4)
                            .map(f64::from)
                            .map(|n| kernel.transform(x - n).abs() + kernel.transform(x + n).abs())
                            .sum();
                        data(lag) * images / kernel.transform(x)
                    })
                    .fold(0.0, f64::max);
                // The points of the fit.
                println!("{name} {log_error}: {:.2}", -worst.ln());
                assert!(worst < (-log_error).exp(), "{name} {log_error}: {worst}");
            }
        }
    }

    /// Autocorrelation of a Tukey window with a raised cosine over a quarter of the width at each edge, 1 at the lag 0.
    /// Lags are in widths.
    fn tapered_scan(lag: f64) -> f64 {
        let taper = |x: f64| {
            let from_edge = x.min(1.0 - x);
            if from_edge <= 0.0 {
                0.0
            } else if from_edge < 0.25 {
                0.5 - 0.5 * (2.0 * TAU * from_edge).cos()
            } else {
                1.0
            }
        };
        let sum =
            |lag: f64| (0..1000).map(|i| (f64::from(i) + 0.5) / 1000.0).map(|x| taper(x) * taper(x + lag)).sum::<f64>();
        sum(lag) / sum(0.0)
    }
}
