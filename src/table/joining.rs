//! How the nodes of a lattice are joined to values between them, along one axis.

use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Places of the integrals over half a semicircle.
const PLACES: usize = 512;

/// The weight of a node at a distance, in nodes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Joining {
    /// The Gaussian of an order, `exp(−d²/2σ²)`: exact where nodes are orders.
    Gaussian {
        /// Standard deviation in nodes.
        sigma: f64,
    },
    /// The exponential of a semicircle, `exp(β(√(1 − (d/r)²) − 1))` for `|d| < r`, else nothing. Its transform falls off as
    /// fast as that of anything so narrow can, so that few nodes join what was sampled at hardly more than its own rate
    /// (Barnett, Magland, af Klinteberg, *A parallel nonuniform fast Fourier transform library based on an "exponential
    /// of semicircle" kernel*, SIAM J. Sci. Comput. 41, 2019).
    Semicircle {
        /// β of the exponent.
        beta: f64,
        /// r in nodes.
        radius: f64,
    },
}

impl Joining {
    /// The weight at a distance.
    pub fn weight(self, distance: f64) -> f64 {
        match self {
            Self::Gaussian { sigma } => (-0.5 * (distance / sigma).powi(2)).exp(),
            Self::Semicircle { beta, radius } => {
                let rest = 1.0 - (distance / radius).powi(2);
                if rest > 0.0 { (beta * (rest.sqrt() - 1.0)).exp() } else { 0.0 }
            }
        }
    }

    /// Its transform `∫ weight(d)·cos(2πd·x) dd`.
    pub fn transform(self, x: f64) -> f64 {
        match self {
            Self::Gaussian { sigma } => TAU.sqrt() * sigma * (-0.5 * (TAU * sigma * x).powi(2)).exp(),
            Self::Semicircle { .. } => self.integral(|d| (TAU * d * x).cos()),
        }
    }

    /// Its standard deviation.
    pub fn sigma(self) -> f64 {
        match self {
            Self::Gaussian { sigma } => sigma,
            Self::Semicircle { .. } => (self.integral(|d| d * d) / self.transform(0.0)).sqrt(),
        }
    }

    /// The integral of the weight of a semicircle times an even function of the distance.
    fn integral(self, of: impl Fn(f64) -> f64) -> f64 {
        let Self::Semicircle { beta, radius } = self else { return f64::NAN };
        let step = FRAC_PI_2 / PLACES as f64;
        let part = |i: usize| {
            let (sin, cos) = ((i as f64 + 0.5) * step).sin_cos();
            (beta * (cos - 1.0)).exp() * cos * of(radius * sin)
        };
        2.0 * radius * step * (0..PLACES).map(part).sum::<f64>()
    }
}

/// What divides a period of the lattice by the largest lag that it has to tell apart.
pub(super) const OVERSAMPLING: f64 = 3.0;

/// The semicircle that joins a lattice of [`OVERSAMPLING`] with images below `e^−log_error`, and the nodes that it reads.
/// Measured for the autocorrelation of a tapered scan and for a Gaussian window: images fall by `e^2.1` for each node.
pub(super) fn semicircle(log_error: f64) -> (Joining, usize) {
    let taps = ((log_error + 0.6) / 2.1).ceil().max(2.0);
    (Joining::Semicircle { beta: 2.3 * taps, radius: 0.5 * taps }, taps as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_are_those_of_the_weights() {
        for joining in [Joining::Gaussian { sigma: 0.7 }, semicircle(9.0).0, semicircle(18.0).0] {
            let steps = 20_000;
            let at = |i: i32| 12.0 * (f64::from(i) + 0.5) / f64::from(steps);
            let sum = |of: &dyn Fn(f64) -> f64| -> f64 {
                (0..steps).map(|i| joining.weight(at(i)) * of(at(i))).sum::<f64>() * 24.0 / f64::from(steps)
            };
            for x in [0.0, 0.1, 0.33, 0.8, 1.2] {
                let (direct, transform) = (sum(&|d| (TAU * d * x).cos()), joining.transform(x));
                // The sum's steps, at the end of the semicircle where it falls by e^−β at once.
                assert!((direct - transform).abs() < 1e-7, "{joining:?} {x}: {direct} {transform}");
            }
            let variance = sum(&|d| d * d) / sum(&|_| 1.0);
            assert!((joining.sigma().powi(2) - variance).abs() < 1e-6, "{joining:?}");
        }
    }

    #[test]
    fn images_are_as_small_as_planned() {
        // The autocorrelation of a Tukey window over all lags that there are, and a Gaussian out to where it is below the error.
        for log_error in [8.0f64, 9.7, 11.8, 14.0, 18.7] {
            let (joining, _) = semicircle(log_error);
            let gaussian = |lag: f64| (-log_error * lag * lag).exp();
            for (name, of) in [("scan", &tapered as &dyn Fn(f64) -> f64), ("window", &gaussian)] {
                let worst = (0..=50)
                    .map(|i| f64::from(i) / 50.0)
                    .map(|lag| {
                        let x = lag / OVERSAMPLING;
                        let images: f64 = (1..4)
                            .map(f64::from)
                            .map(|n| joining.transform(x - n).abs() + joining.transform(x + n).abs())
                            .sum();
                        of(lag) * images / joining.transform(x)
                    })
                    .fold(0.0, f64::max);
                println!("{name} {log_error}: {:.2}", -worst.ln());
                assert!(worst < (-log_error).exp(), "{name} {log_error}: {worst}");
            }
        }
    }

    /// The autocorrelation of a raised-cosine taper over a quarter of either side, lags in widths.
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
