//! One profile with its nodes, made once for any wavelength and direction.

use crate::error::{finite, positive};
use crate::interpolation::Interpolation;
use crate::linear::{Matrix, from_fn};
use crate::nodes::{Nodes, share};
use crate::profile::Shape;
use crate::{Air, Error, Medium, Profile};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// Fewest nodes on one period: the interpolation reaches over 17.
const NODES_MIN: usize = 24;
/// Fewest nodes that are taken without being asked for.
const NODES_LEAST: usize = 64;
/// Most nodes on one period: a system of 2 × 2048 unknowns takes half a minute.
pub(crate) const NODES_MAX: usize = 2048;

/// How finely the curve is resolved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    /// Nodes on one period, at least 24; a few more where edges ask for it.
    pub nodes: usize,
    /// The metal's integrals are taken on so many times as many nodes (odd), since its fields fall off within the skin depth.
    pub oversampling: usize,
}

/// Finest steps along the curve, in skin depths: twice as many leave a hundred times the error.
const SKIN_DEPTHS: f64 = 0.9;
const OVERSAMPLING_MAX: usize = 15;

impl Resolution {
    /// What a medium asks for at a wavelength (nm): 64 nodes, more for many edges and where the curve is many waves
    /// long; and finer ones as the skin depth asks for.
    ///
    /// For several media or wavelengths take the largest of each number.
    ///
    /// # Errors
    /// A wavelength that is not finite and positive.
    pub fn new(profile: &Profile, medium: &Medium, wavelength_nm: f64) -> Result<Self, Error> {
        let k = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
        let index = match *medium {
            Medium::Perfect => Complex64::ONE,
            Medium::Index(index) => index,
        };
        let waves = profile.arc_um() * k / TAU * index.re.max(1.0);
        let (least, per_wave) = match &profile.shape {
            Shape::Smooth(harmonics) => (NODES_LEAST.max(8 * harmonics.len()), 9.0),
            Shape::Edges(edges) => (NODES_LEAST.max(16 * edges.len()), 13.0),
        };
        let nodes = least.max((per_wave * waves).min(1e9) as usize).next_multiple_of(4);
        if nodes > NODES_MAX || *medium == Medium::Perfect {
            return Ok(Self { nodes, oversampling: 1 });
        }
        let steps = widest_step(profile, &share(profile, nodes)) * k * index.im / SKIN_DEPTHS;
        let oversampling = if index.im > 0.0 || profile.has_corners() { 3.max(steps.ceil() as usize) } else { 1 };
        // Beyond that, nodes themselves have to be closer.
        let excess = (oversampling as f64 / OVERSAMPLING_MAX as f64).max(1.0);
        let oversampling = oversampling.min(OVERSAMPLING_MAX) / 2 * 2 + 1;
        Ok(Self { nodes: ((nodes as f64 * excess).ceil() as usize).next_multiple_of(4), oversampling })
    }
}

/// The longest step between nodes, in µm: grading doubles those in the middle of an edge.
fn widest_step(profile: &Profile, counts: &[usize]) -> f64 {
    match &profile.shape {
        Shape::Smooth(_) => profile.arc_um() / counts[0] as f64,
        Shape::Edges(edges) => {
            edges.iter().zip(counts).map(|(edge, &n)| 2.0 * edge.chord() / n as f64).fold(0.0, f64::max)
        }
    }
}

/// Nodes and weights of a profile.
pub struct Discretisation {
    profile: Profile,
    resolution: Resolution,
    pub(crate) coarse: Nodes,
    pub(crate) fine: Nodes,
    pub(crate) interpolation: Interpolation,
}

impl Discretisation {
    /// Places nodes on a profile.
    ///
    /// # Errors
    /// Fewer than 24 nodes or more than 2048, an even oversampling or one above 15.
    pub fn new(profile: &Profile, resolution: Resolution) -> Result<Self, Error> {
        let Resolution { nodes, oversampling } = resolution;
        if !(NODES_MIN..=NODES_MAX).contains(&nodes) {
            return Err(Error::OutOfRange { quantity: "nodes", found: nodes as f64, accepted: "24 to 2048" });
        }
        if oversampling % 2 == 0 || oversampling > OVERSAMPLING_MAX {
            let found = oversampling as f64;
            return Err(Error::OutOfRange { quantity: "oversampling", found, accepted: "odd, 1 to 15" });
        }
        let counts = share(profile, nodes);
        let finer: Vec<usize> = counts.iter().map(|n| n * oversampling).collect();
        let (coarse, fine) = (Nodes::new(profile, &counts), Nodes::new(profile, &finer));
        let interpolation = Interpolation::new(coarse.len(), oversampling);
        Ok(Self { profile: profile.clone(), resolution, coarse, fine, interpolation })
    }

    /// The profile.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The resolution asked for.
    pub fn resolution(&self) -> Resolution {
        self.resolution
    }

    /// Nodes on one period.
    pub fn nodes(&self) -> usize {
        self.coarse.len()
    }

    /// All that depends on `t = d·κ/2π` and the phase `b` in turns a period alone, with κ² = k² − ky²: order m has
    /// α = 2π(b + m)/d and propagates while |b + m| < t.
    ///
    /// # Errors
    /// t not above 0 or above a third of the nodes, b not finite, or sums that are not finite.
    pub fn air(&self, t: f64, b: f64) -> Result<Air<'_>, Error> {
        positive("t", t)?;
        // Fewer than three nodes a wave.
        if t > self.nodes() as f64 / 3.0 {
            return Err(Error::OutOfRange { quantity: "t", found: t, accepted: "up to a third of the nodes" });
        }
        Air::new(self, t, finite("b", b)?)
    }

    /// Derivative over the parameter for quasi-periodic functions at the nodes.
    pub(crate) fn derivative(&self, bloch: f64) -> Matrix {
        let (nodes, n) = (&self.coarse, self.coarse.len());
        let alpha = TAU * bloch / nodes.period;
        let turn: Vec<Complex64> = nodes.x.iter().map(|x| Complex64::cis(alpha * x)).collect();
        from_fn(n, n, |i, j| {
            if i == j {
                Complex64::new(0.0, alpha * nodes.normal[i][1] * nodes.speed[i])
            } else {
                let k = (i + n - j) % n;
                let sign = if k % 2 == 0 { 0.5 } else { -0.5 };
                turn[i] * turn[j].conj() * (sign / (PI * k as f64 / n as f64).tan())
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of trigonometric polynomials that the nodes resolve.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn waves_are_differentiated_exactly() {
        let profile = Profile::flat(TAU).unwrap();
        let mesh = Discretisation::new(&profile, Resolution { nodes: 24, oversampling: 3 }).unwrap();
        let bloch = 0.3;
        let derivative = mesh.derivative(bloch);
        let field = |x: f64| Complex64::cis((2.0 + bloch) * x);
        for (i, &x) in mesh.coarse.x.iter().enumerate() {
            let sum: Complex64 = mesh.coarse.x.iter().enumerate().map(|(j, &y)| derivative[(i, j)] * field(y)).sum();
            assert!((sum - Complex64::I * (2.0 + bloch) * field(x)).norm() < ROUNDING);
        }
    }

    #[test]
    fn resolutions_that_do_not_serve_are_named() {
        let profile = Profile::flat(1.0).unwrap();
        for (nodes, oversampling, named) in [(8, 3, "nodes"), (4096, 3, "nodes"), (64, 4, "oversampling")] {
            let message = Discretisation::new(&profile, Resolution { nodes, oversampling }).err().unwrap().to_string();
            assert!(message.contains(named), "{message}");
        }
    }
}
