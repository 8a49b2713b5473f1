//! A profile with nodes on it, for any wavelength and direction; and the number of nodes that a problem needs.
//!
//! Unknown fields live on *coarse* nodes. Integrals of the lower medium run over *fine* nodes, `oversampling` times as
//! many, because fields in a metal vary within the skin depth 1/Im(kn). `nodes.rs` defines nodes and their parameter τ,
//! `lib.rs` the symbols t, b, κ and αm. In the comments of constants, *checks of power* are
//! [`Amplitudes::balance_error`](crate::Amplitudes::balance_error) over the tested gratings.

use crate::error::{finite, positive};
use crate::interpolation::Interpolation;
use crate::linear::{Matrix, from_fn};
use crate::nodes::{Nodes, distribute_nodes};
use crate::profile::Shape;
use crate::{Air, Error, Medium, Profile};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// Fewest accepted nodes on one period: the interpolation to finer nodes uses 17 of them.
const NODES_MIN: usize = 24;
/// Fewest nodes that [`Resolution::new`] returns. Chosen by the checks of power.
const NODES_DEFAULT: usize = 64;
/// Fewest nodes for each Fourier harmonic of a smooth profile. Chosen: the fields have higher harmonics than the
/// relief.
const NODES_PER_HARMONIC: usize = 8;
/// Fewest nodes on average for each edge. Chosen: twice the smallest number on an edge (`nodes.rs`).
const NODES_PER_EDGE: usize = 16;
/// Fewest nodes for each wavelength κ on one period that [`Discretisation::air`] accepts. Chosen above the two of the
/// sampling theorem.
const NODES_PER_WAVE_MIN: f64 = 3.0;
/// Smallest oversampling above an absorbing medium or a profile with corners. Chosen.
const OVERSAMPLING_MIN: usize = 3;
/// Most nodes on one period. Chosen: a system of 2 × 2048 unknowns takes half a minute on one core.
pub(crate) const NODES_MAX: usize = 2048;

/// Number of nodes on one period of the curve, for the air and for the lower medium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    /// Nodes on one period, at least 24. A profile with many edges gets a few more.
    pub nodes: usize,
    /// Ratio of the lower medium's nodes to `nodes`, odd: its fields vary within the skin depth.
    pub oversampling: usize,
}

/// Largest step along the curve between fine nodes, in skin depths. Chosen: twice the step leaves a hundred times the
/// error.
const SKIN_DEPTHS: f64 = 0.9;
/// Largest oversampling. Chosen: beyond it more nodes are cheaper than finer integrals.
const OVERSAMPLING_MAX: usize = 15;
/// Nodes for each wavelength along a smooth curve, in air or in the medium, whichever is shorter. Chosen by the checks
/// of power.
const NODES_PER_WAVE_SMOOTH: f64 = 9.0;
/// Nodes for each wavelength along a curve with corners. Chosen larger than for smooth curves: grading towards the
/// corners widens steps in the middle of an edge.
const NODES_PER_WAVE_EDGES: f64 = 13.0;

impl Resolution {
    /// The resolution that a medium needs at a wavelength (nm).
    ///
    /// At least 64 nodes; more for many edges or harmonics, and for a curve of many wavelengths. The oversampling
    /// follows from the skin depth. For several media or wavelengths take the largest of each number.
    ///
    /// ```
    /// use sunbeam_rigorous::{Medium, Profile, Resolution};
    ///
    /// let perfect = Resolution::new(&Profile::sinusoid(1.1, 0.1)?, &Medium::Perfect, 550.0)?;
    /// assert_eq!(perfect, Resolution { nodes: 64, oversampling: 1 });
    /// # Ok::<(), sunbeam_rigorous::Error>(())
    /// ```
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
            Shape::Smooth(harmonics) => {
                (NODES_DEFAULT.max(NODES_PER_HARMONIC * harmonics.len()), NODES_PER_WAVE_SMOOTH)
            }
            Shape::Edges(edges) => (NODES_DEFAULT.max(NODES_PER_EDGE * edges.len()), NODES_PER_WAVE_EDGES),
        };
        let nodes = least.max((per_wave * waves).min(1e9) as usize).next_multiple_of(4);
        if nodes > NODES_MAX || *medium == Medium::Perfect {
            return Ok(Self { nodes, oversampling: 1 });
        }
        let steps = widest_step(profile, &distribute_nodes(profile, nodes)) * k * index.im / SKIN_DEPTHS;
        let oversampling =
            if index.im > 0.0 || profile.has_corners() { OVERSAMPLING_MIN.max(steps.ceil() as usize) } else { 1 };
        // Beyond the largest oversampling the nodes themselves are multiplied.
        let excess = (oversampling as f64 / OVERSAMPLING_MAX as f64).max(1.0);
        let oversampling = oversampling.min(OVERSAMPLING_MAX) / 2 * 2 + 1;
        Ok(Self { nodes: ((nodes as f64 * excess).ceil() as usize).next_multiple_of(4), oversampling })
    }
}

/// Longest step between nodes, in µm. Grading towards corners doubles the step in the middle of an edge.
fn widest_step(profile: &Profile, counts: &[usize]) -> f64 {
    match &profile.shape {
        Shape::Smooth(_) => profile.arc_um() / counts[0] as f64,
        Shape::Edges(edges) => {
            edges.iter().zip(counts).map(|(edge, &n)| 2.0 * edge.chord() / n as f64).fold(0.0, f64::max)
        }
    }
}

/// Nodes on one period of a profile, and the interpolation from them to the finer nodes of the lower medium.
///
/// ```
/// use sunbeam_rigorous::{Discretisation, Medium, Profile, Resolution};
///
/// let profile = Profile::blazed(1.2, 0.1)?;
/// let mesh = Discretisation::new(&profile, Resolution { nodes: 64, oversampling: 1 })?;
/// // Orders −1, 0 and 1 propagate: |b + m| < t.
/// let amplitudes = mesh.air(1.5, 0.2)?.solve(&Medium::Perfect, 550.0)?;
/// assert_eq!(amplitudes.orders(), [-1, 0, 1]);
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
pub struct Discretisation {
    profile: Profile,
    resolution: Resolution,
    /// Nodes of the unknowns.
    pub(crate) coarse: Nodes,
    /// Nodes of the lower medium's integrals: `oversampling` for each coarse one, of which the middle one coincides
    /// with it.
    pub(crate) fine: Nodes,
    /// Interpolation of fields from the coarse to the fine nodes.
    pub(crate) interpolation: Interpolation,
}

impl Discretisation {
    /// Distributes nodes over a profile.
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
        let counts = distribute_nodes(profile, nodes);
        let finer: Vec<usize> = counts.iter().map(|n| n * oversampling).collect();
        let (coarse, fine) = (Nodes::new(profile, &counts), Nodes::new(profile, &finer));
        let interpolation = Interpolation::new(coarse.len(), oversampling);
        Ok(Self { profile: profile.clone(), resolution, coarse, fine, interpolation })
    }

    /// The profile.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The resolution passed to [`Discretisation::new`].
    pub fn resolution(&self) -> Resolution {
        self.resolution
    }

    /// Nodes on one period.
    pub fn nodes(&self) -> usize {
        self.coarse.len()
    }

    /// The air above the relief at `t = κd/2π` and Bloch phase `b` in turns (symbols: [crate]).
    ///
    /// # Errors
    /// t not above 0 or above a third of the nodes, b not finite, or special functions that overflow.
    pub fn air(&self, t: f64, b: f64) -> Result<Air<'_>, Error> {
        positive("t", t)?;
        if t > self.nodes() as f64 / NODES_PER_WAVE_MIN {
            return Err(Error::OutOfRange { quantity: "t", found: t, accepted: "up to a third of the nodes" });
        }
        Air::new(self, t, finite("b", b)?)
    }

    /// Matrix D of the derivative with respect to the nodes' parameter τ, for functions with Bloch phase `bloch`
    /// (turns).
    ///
    /// It is the trigonometric differentiation matrix applied to the periodic function `u·e^{−iαx}`, α = 2π·bloch/d.
    pub(crate) fn derivative(&self, bloch: f64) -> Matrix {
        let (nodes, n) = (&self.coarse, self.coarse.len());
        let alpha = TAU * bloch / nodes.period;
        let phase: Vec<Complex64> = nodes.x.iter().map(|x| Complex64::cis(alpha * x)).collect();
        from_fn(n, n, |i, j| {
            if i == j {
                Complex64::new(0.0, alpha * nodes.normal[i][1] * nodes.speed[i])
            } else {
                let k = (i + n - j) % n;
                let sign = if k % 2 == 0 { 0.5 } else { -0.5 };
                phase[i] * phase[j].conj() * (sign / (PI * k as f64 / n as f64).tan())
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding: the derivative of a resolved trigonometric polynomial is exact.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn derivative_of_a_wave_is_exact() {
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
    fn errors_name_the_refused_number() {
        let profile = Profile::flat(1.0).unwrap();
        for (nodes, oversampling, named) in [(8, 3, "nodes"), (4096, 3, "nodes"), (64, 4, "oversampling")] {
            let message = Discretisation::new(&profile, Resolution { nodes, oversampling }).err().unwrap().to_string();
            assert!(message.contains(named), "{message}");
        }
    }
}
