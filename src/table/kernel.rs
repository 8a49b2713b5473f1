//! Interpolation kernels: weights of the lattice nodes about a frequency, along one axis.
//!
//! A look-up at position p (in nodes) sums node values with weights φ(p − j). In lag space the sum is a product with the
//! transform φ̂(x), where x is the lag over the lattice's period. The sum also adds images: the data shifted by n periods,
//! weighted by φ̂(x − n). Therefore the data are divided by φ̂ before the nodes are computed (`LatticeAxis::window`), and
//! a wider kernel has weaker images.

use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Midpoint nodes per quarter turn of the semicircle's integrals. They converge geometrically. At 512 the error is below
/// rounding for each exponent up to β = 50.
const QUADRATURE_NODES: usize = 512;

/// Weight `φ(d)` of a node at distance `d`, in nodes.
///
/// ```
/// use sunbeam::table::InterpolationKernel;
///
/// let order = InterpolationKernel::Gaussian { sigma: 0.7 };
/// assert_eq!(order.weight(0.0), 1.0);
/// assert_eq!(order.sigma(), 0.7);
/// // The transform at zero is the kernel's integral.
/// assert!((order.transform(0.0) - std::f64::consts::TAU.sqrt() * 0.7).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum InterpolationKernel {
    /// The Gaussian of an order, `exp(−d²/2σ²)`: exact where nodes are orders.
    Gaussian {
        /// Standard deviation σ in nodes.
        sigma: f64,
    },
    /// The exponential of a semicircle, `exp(β(√(1 − (d/r)²) − 1))` for `|d| < r`, zero beyond.
    ///
    /// Few nodes interpolate data that are sampled at little more than their own rate, since its transform falls almost as
    /// fast as that of any kernel of its width can (Barnett, Magland, af Klinteberg, *A parallel nonuniform fast Fourier
    /// transform library based on an "exponential of semicircle" kernel*, SIAM J. Sci. Comput. 41, 2019).
    Semicircle {
        /// Exponent β.
        beta: f64,
        /// Radius r in nodes.
        radius: f64,
    },
}

impl InterpolationKernel {
    /// Weight at a distance in nodes.
    pub fn weight(self, distance: f64) -> f64 {
        match self {
            Self::Gaussian { sigma } => (-0.5 * (distance / sigma).powi(2)).exp(),
            Self::Semicircle { beta, radius } => {
                let rest = 1.0 - (distance / radius).powi(2);
                if rest > 0.0 { (beta * (rest.sqrt() - 1.0)).exp() } else { 0.0 }
            }
        }
    }

    /// Fourier transform `∫ φ(d)·cos(2πd·x) dd`.
    pub fn transform(self, x: f64) -> f64 {
        match self {
            Self::Gaussian { sigma } => TAU.sqrt() * sigma * (-0.5 * (TAU * sigma * x).powi(2)).exp(),
            Self::Semicircle { beta, radius } => semicircle_integral(beta, radius, |d| (TAU * d * x).cos()),
        }
    }

    /// Standard deviation in nodes.
    pub fn sigma(self) -> f64 {
        match self {
            Self::Gaussian { sigma } => sigma,
            Self::Semicircle { beta, radius } => {
                (semicircle_integral(beta, radius, |d| d * d) / self.transform(0.0)).sqrt()
            }
        }
    }
}

/// `∫ φ(d)·even(d) dd` for a semicircle and an even function, over the angle of `d = r·sin`.
fn semicircle_integral(beta: f64, radius: f64, even: impl Fn(f64) -> f64) -> f64 {
    let step = FRAC_PI_2 / QUADRATURE_NODES as f64;
    let term = |i: usize| {
        let (sin, cos) = ((i as f64 + 0.5) * step).sin_cos();
        (beta * (cos - 1.0)).exp() * cos * even(radius * sin)
    };
    2.0 * radius * step * (0..QUADRATURE_NODES).map(term).sum::<f64>()
}

/// Period of an oversampled lattice over the largest lag of its data. A larger ratio needs more nodes in the table. At 2.5,
/// images of a scan grow by a factor of two to five for the same number of nodes read.
pub(super) const OVERSAMPLING: f64 = 3.0;

/// Natural logarithm by which images fall for each node that the kernel reads, at [`OVERSAMPLING`] 3. Measured for the
/// autocorrelation of a tapered scan and for a Gaussian window (test `images_stay_below_the_planned_error`).
const LOG_IMAGE_PER_NODE: f64 = 2.1;
/// Natural logarithm of the images of a kernel of no width, by the same measurement.
const LOG_IMAGE_OFFSET: f64 = 0.6;
/// Exponent β for each node that the kernel reads. 2.3 minimises the images of 5 to 8 nodes in the same measurement; at
/// 2.1 and 2.5 they are about twice as strong.
const BETA_PER_NODE: f64 = 2.3;

/// Semicircle whose images stay below `e^−log_error` on a lattice of [`OVERSAMPLING`], and the number of nodes that it reads.
pub(super) fn semicircle(log_error: f64) -> (InterpolationKernel, usize) {
    let taps = ((log_error + LOG_IMAGE_OFFSET) / LOG_IMAGE_PER_NODE).ceil().max(2.0);
    (InterpolationKernel::Semicircle { beta: BETA_PER_NODE * taps, radius: 0.5 * taps }, taps as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KERNELS: [fn() -> InterpolationKernel; 3] =
        [|| InterpolationKernel::Gaussian { sigma: 0.7 }, || semicircle(9.0).0, || semicircle(18.0).0];

    /// `∫ φ(d)·even(d) dd` by 20 000 midpoints over 12 nodes either side.
    fn midpoint_sum(kernel: InterpolationKernel, even: impl Fn(f64) -> f64) -> f64 {
        const STEPS: i32 = 20_000;
        let at = |i: i32| 12.0 * (f64::from(i) + 0.5) / f64::from(STEPS);
        (0..STEPS).map(|i| kernel.weight(at(i)) * even(at(i))).sum::<f64>() * 24.0 / f64::from(STEPS)
    }

    #[test]
    fn transforms_match_midpoint_sums() {
        for kernel in KERNELS.map(|kernel| kernel()) {
            for x in [0.0, 0.1, 0.33, 0.8, 1.2] {
                let (direct, transform) = (midpoint_sum(kernel, |d| (TAU * d * x).cos()), kernel.transform(x));
                // Error of the midpoints where the semicircle ends with a step of e^−β.
                assert!((direct - transform).abs() < 1e-7, "{kernel:?} {x}: {direct} {transform}");
            }
        }
    }

    #[test]
    fn variances_match_midpoint_sums() {
        for kernel in KERNELS.map(|kernel| kernel()) {
            let variance = midpoint_sum(kernel, |d| d * d) / midpoint_sum(kernel, |_| 1.0);
            assert!((kernel.sigma().powi(2) - variance).abs() < 1e-6, "{kernel:?}");
        }
    }

    #[test]
    fn images_stay_below_the_planned_error() {
        // Autocorrelation of a Tukey window over all its lags, and a Gaussian down to the error.
        for log_error in [8.0f64, 9.7, 11.8, 14.0, 18.7] {
            let (kernel, _) = semicircle(log_error);
            let gaussian = |lag: f64| (-log_error * lag * lag).exp();
            for (name, data) in [("scan", &tapered as &dyn Fn(f64) -> f64), ("window", &gaussian)] {
                let worst = (0..=50)
                    .map(|i| f64::from(i) / 50.0)
                    .map(|lag| {
                        let x = lag / OVERSAMPLING;
                        let images: f64 = (1..4)
                            .map(f64::from)
                            .map(|n| kernel.transform(x - n).abs() + kernel.transform(x + n).abs())
                            .sum();
                        data(lag) * images / kernel.transform(x)
                    })
                    .fold(0.0, f64::max);
                println!("{name} {log_error}: {:.2}", -worst.ln());
                assert!(worst < (-log_error).exp(), "{name} {log_error}: {worst}");
            }
        }
    }

    /// Autocorrelation of a raised-cosine taper over a quarter of either side, lags in widths.
    fn tapered(lag: f64) -> f64 {
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
