//! A profile with nodes on it, for any wavelength and direction; and the number of nodes that a problem needs.
//!
//! The unknown fields are computed at *coarse* nodes. Integrals of the lower medium use *fine* nodes, `oversampling`
//! for each coarse node, because fields in a metal vary within the skin depth 1/Im(kn). `nodes.rs` defines nodes and
//! their parameter τ.
//!
//! k is the wave number in vacuum. κ and κm are the wave numbers in the plane across the grooves, in the air and in the
//! lower medium of index n. With the period d, t = κd/2π and tm = κm·d/2π are the numbers of wavelengths 2π/κ and 2π/κm
//! in one period (`lib.rs`).
//!
//! Several constants are set by the power balance: with them,
//! [`Amplitudes::balance_error`](crate::Amplitudes::balance_error) stays below 1e-3 on the gratings of the tests.

use crate::error::{finite, positive};
use crate::interpolation::{Interpolation, WIDTH};
use crate::linear::{Matrix, from_fn};
use crate::nodes::{EDGE_NODES_MIN, Nodes, distribute_nodes};
use crate::profile::Shape;
use crate::{Air, Below, Error, Medium, Profile};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// Fewest accepted nodes on one period: the interpolation to fine nodes uses 17 neighbouring ones, which must be
/// distinct.
const NODES_MIN: usize = WIDTH;
/// Most accepted nodes on one period. At this number [`Estimate`](crate::Estimate) expects 50 s a solution on one core.
pub(crate) const NODES_MAX: usize = 2048;
/// Fewest nodes that [`Resolution::new`] chooses. Fewer leave a larger error of the power balance.
const NODES_CHOSEN_MIN: usize = 64;
/// Fewest nodes for each Fourier harmonic of a smooth profile, its mean included. The fields have higher harmonics than
/// the relief; fewer nodes resolve fewer of them, more take more time.
const NODES_PER_HARMONIC: usize = 8;
/// Fewest nodes for each edge, on average over the edges: twice the smallest number on one edge, so that long edges get
/// more than this number.
pub(crate) const NODES_PER_EDGE: usize = 2 * EDGE_NODES_MIN;
/// Nodes for each wavelength along a smooth curve, for the shorter wavelength 2π/k or 2π/(k·Re n) of the two media. k
/// is the wave number in vacuum. Fewer nodes leave a larger error of the power balance.
const NODES_PER_WAVE_SMOOTH: f64 = 9.0;
/// Nodes for each wavelength along a curve with corners: more than along smooth curves, because grading towards the
/// corners widens steps in the middle of an edge.
const NODES_PER_WAVE_EDGES: f64 = 13.0;
/// Fewest nodes on one period for each wavelength 2π/κ or 2π/κm across the grooves. The sampling theorem requires two;
/// the third is a margin. Larger values refuse problems that could be solved.
const NODES_PER_WAVE_MIN: f64 = 3.0;
/// Smallest oversampling above an absorbing medium or for a profile with corners: the smallest odd number above 1.
const OVERSAMPLING_MIN: usize = 3;
/// Largest oversampling. For finer steps, more nodes take less time than more oversampling.
const OVERSAMPLING_MAX: usize = 15;
/// Largest step along the curve between fine nodes, in skin depths. Twice the step leaves a hundred times the error of
/// the power balance; smaller steps take more time.
const STEP_SKIN_DEPTHS_MAX: f64 = 0.9;

/// Number of nodes on one period of the curve, for the air and for the lower medium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolution {
    /// Coarse nodes on one period, 17 to 2048. On a profile with corners each edge gets a part of them, rounded to a
    /// whole number of at least 8, so the sum may differ.
    pub nodes: usize,
    /// Fine nodes for each coarse node, for the integrals of the lower medium: odd, 1 to 15.
    pub oversampling: usize,
}

impl Resolution {
    /// The resolution that a profile above a medium needs at a wavelength (nm).
    ///
    /// There are at least 64 nodes; more for many edges or harmonics, and for a curve of many wavelengths. The
    /// oversampling follows from the skin depth. For several media or wavelengths take the largest of each number. The
    /// nodes may exceed 2048, which [`Discretisation::new`] refuses.
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
        // Length of the curve in wavelengths of the denser medium; 1 is the index of the air.
        let waves = profile.arc_um() * k / TAU * index.re.max(1.0);
        let (least, per_wave) = match &profile.shape {
            Shape::Smooth(harmonics) => {
                (NODES_CHOSEN_MIN.max(NODES_PER_HARMONIC * harmonics.len()), NODES_PER_WAVE_SMOOTH)
            }
            Shape::Edges(edges) => (NODES_CHOSEN_MIN.max(NODES_PER_EDGE * edges.len()), NODES_PER_WAVE_EDGES),
        };
        // A multiple of 4 is even, as Kress' weights require. The bound keeps the rounding within an integer's range.
        let nodes = least.max((per_wave * waves).min(i32::MAX.into()) as usize).next_multiple_of(4);
        // More nodes than the maximum are refused in any case, and a perfect conductor has no lower medium.
        if nodes > NODES_MAX || *medium == Medium::Perfect {
            return Ok(Self { nodes, oversampling: 1 });
        }
        let skin_depths = widest_step(profile, &distribute_nodes(profile, nodes)) * k * index.im;
        let fine_per_coarse = (skin_depths / STEP_SKIN_DEPTHS_MAX).ceil() as usize;
        let needed = if index.im > 0.0 || profile.has_corners() { OVERSAMPLING_MIN.max(fine_per_coarse) } else { 1 };
        // The part of the oversampling beyond its maximum multiplies the nodes instead.
        let excess = (needed as f64 / OVERSAMPLING_MAX as f64).max(1.0);
        // An even number is rounded up to an odd one.
        let oversampling = needed.min(OVERSAMPLING_MAX) / 2 * 2 + 1;
        Ok(Self { nodes: ((nodes as f64 * excess).ceil() as usize).next_multiple_of(4), oversampling })
    }
}

/// Estimate of the longest step along the curve between coarse nodes, in µm. For a smooth profile it is the mean step.
/// For edges it is twice the largest mean step on an edge, whose length is approximated by the distance of its ends.
/// `counts` are the nodes of each edge (`distribute_nodes`).
fn widest_step(profile: &Profile, counts: &[usize]) -> f64 {
    match &profile.shape {
        Shape::Smooth(_) => profile.arc_um() / counts[0] as f64,
        // Grading towards corners doubles the step in the middle of an edge.
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
    /// Nodes of the unknown fields.
    pub(crate) coarse: Nodes,
    /// Nodes of the lower medium's integrals: `oversampling` for each coarse node, which coincides with the middle one.
    pub(crate) fine: Nodes,
    /// Interpolation of fields from the coarse to the fine nodes.
    pub(crate) interpolation: Interpolation,
}

impl Discretisation {
    /// Distributes nodes over a profile.
    ///
    /// # Errors
    /// Fewer than 17 nodes or more than 2048, an even oversampling or one above 15.
    pub fn new(profile: &Profile, resolution: Resolution) -> Result<Self, Error> {
        let Resolution { nodes, oversampling } = resolution;
        if !(NODES_MIN..=NODES_MAX).contains(&nodes) {
            return Err(Error::OutOfRange { quantity: "nodes", found: nodes as f64, accepted: "17 to 2048" });
        }
        if oversampling % 2 == 0 || oversampling > OVERSAMPLING_MAX {
            let found = oversampling as f64;
            return Err(Error::OutOfRange { quantity: "oversampling", found, accepted: "odd, 1 to 15" });
        }
        let counts = distribute_nodes(profile, nodes);
        let fine_counts: Vec<usize> = counts.iter().map(|n| n * oversampling).collect();
        let (coarse, fine) = (Nodes::new(profile, &counts), Nodes::new(profile, &fine_counts));
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

    /// Coarse nodes on one period: [`Resolution::nodes`] after the rounding on each edge.
    pub fn nodes(&self) -> usize {
        self.coarse.len()
    }

    /// The air above the relief at `t = κd/2π` and Bloch phase `b` in turns (symbols: [crate]).
    ///
    /// # Errors
    /// t not above 0 or above a third of the nodes, b not finite, or special functions that overflow.
    pub fn air(&self, t: f64, b: f64) -> Result<Air<'_>, Error> {
        self.check_resolved("t", t)?;
        Air::new(self, t, finite("b", b)?)
    }

    /// A lossless dielectric below the relief at tm = κm·d/2π and Bloch phase `b` in turns.
    ///
    /// # Errors
    /// tm not above 0 or above a third of the nodes, b not finite, or special functions that overflow.
    pub fn below(&self, tm: f64, b: f64) -> Result<Below, Error> {
        self.check_resolved("tm", tm)?;
        Below::new(self, tm, finite("b", b)?)
    }

    /// The air above a dielectric of index `eta`, at tm = κm·d/2π of the medium, Bloch phase `b` in turns and a
    /// wavelength (nm). No order propagates in the air where κ² is negative.
    ///
    /// # Errors
    /// tm, `eta` or the wavelength not above 0, tm above a third of the nodes, b not finite, or special functions that
    /// overflow.
    pub fn air_above(&self, tm: f64, b: f64, eta: f64, wavelength_nm: f64) -> Result<Air<'_>, Error> {
        self.check_resolved("tm", tm)?;
        let k = TAU * 1e3 / positive("wavelength in nm", wavelength_nm)?;
        let kappa_m = TAU * tm / self.profile.period_um();
        // κ² = κm² − (n² − 1)k², from κ² = k² − ky² and κm² = n²k² − ky².
        let kappa_squared = kappa_m * kappa_m - (positive("eta", eta)?.powi(2) - 1.0) * k * k;
        Air::at_kappa_squared(self, kappa_squared, finite("b", b)?)
    }

    /// Refuses a number `waves` of wavelengths in one period, t or tm, that is not above 0 or too large for the nodes.
    /// `quantity` names the number in the error.
    ///
    /// # Errors
    /// [`Error::OutOfRange`].
    fn check_resolved(&self, quantity: &'static str, waves: f64) -> Result<(), Error> {
        if positive(quantity, waves)? > self.nodes() as f64 / NODES_PER_WAVE_MIN {
            return Err(Error::OutOfRange { quantity, found: waves, accepted: "up to a third of the nodes" });
        }
        Ok(())
    }

    /// Matrix D of the derivative with respect to the nodes' parameter τ, of period 2π, for a function u with the Bloch
    /// phase `bloch` (turns): u changes by the factor e^{2πi·bloch} from one period to the next.
    ///
    /// With α = 2π·bloch/d, `v = u·e^{−iαx}` is periodic and `du/dτ = e^{iαx}·(dv/dτ + iα·dx/dτ·v)`. The matrix of
    /// dv/dτ differentiates the trigonometric interpolation of v: `½(−1)^{i−j}·cot(π(i − j)/n)`, zero on the diagonal.
    /// The number of nodes n is even (`distribute_nodes`).
    pub(crate) fn derivative(&self, bloch: f64) -> Matrix {
        let (nodes, n) = (&self.coarse, self.coarse.len());
        let alpha = TAU * bloch / nodes.period;
        let phase: Vec<Complex64> = nodes.x.iter().map(|x| Complex64::cis(alpha * x)).collect();
        from_fn(n, n, |i, j| {
            if i == j {
                // dx/dτ is the normal's z component times the speed.
                Complex64::new(0.0, alpha * nodes.normal[i][1] * nodes.speed[i])
            } else {
                let apart = (i + n - j) % n;
                let half_sign = if apart % 2 == 0 { 0.5 } else { -0.5 };
                phase[i] * phase[j].conj() * (half_sign / (PI * apart as f64 / n as f64).tan())
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
            let sources = mesh.coarse.x.iter().enumerate();
            let sum: Complex64 = sources.map(|(j, &source)| derivative[(i, j)] * field(source)).sum();
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
