//! One period of a relief that varies along x alone.

mod edge;
mod samples;

use crate::Error;
use crate::discretisation::{NODES_MAX, NODES_PER_EDGE};
use crate::error::{finite, positive};
pub(crate) use edge::{Edge, Point};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Largest ratio of height to period. `HEIGHT_WAVES_MAX` (`limits.rs`) is measured at this ratio. Deeper reliefs need
/// more terms of the lattice sum along z (`lattice_sum.rs`), so a larger ratio would lower that limit.
const DEPTH_MAX: f64 = 2.0;

/// Most corners in one period, 64. In sampled heights a wall counts as one corner, but it is an edge itself, and
/// another edge begins there. With at most two edges for each corner, [`NODES_MAX`] nodes suffice for
/// [`NODES_PER_EDGE`] on each edge.
const CORNERS_MAX: usize = NODES_MAX / (2 * NODES_PER_EDGE);

/// Length of the shortest accepted edge, in periods. Positions are rounded to about 1e-16 periods, so the direction of
/// such an edge has seven digits. Shorter edges have fewer.
const EDGE_MIN: f64 = 1e-9;

/// One period of a relief: either smooth, or edges that meet in corners. Lengths are in µm.
///
/// Air lies above; z points up. Phases of the orders refer to the point x = 0, z = 0 of the coordinates in which the
/// profile is given.
///
/// ```
/// use sunbeam_rigorous::Profile;
///
/// let lamellar = Profile::lamellar(1.6, 0.12, 0.5)?;
/// assert!((lamellar.height_um() - 0.12).abs() < 1e-12 && lamellar.has_corners());
/// // A triangle by its corners (x, z).
/// let triangle = Profile::polygon(2.0, &[[0.0, 0.0], [1.0, 0.3]])?;
/// assert!((triangle.arc_um() - 2.0 * 1.0_f64.hypot(0.3)).abs() < 1e-9);
/// # Ok::<(), sunbeam_rigorous::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Period in µm.
    period: f64,
    /// The curve.
    pub(crate) shape: Shape,
}

/// Geometry of a [`Profile`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    /// Harmonics: Fourier coefficients c_m in µm, m from 0 on, of the height `Re Σ_m c_m e^{2πimx/period}`.
    Smooth(Vec<Complex64>),
    /// Connected edges; the last one ends one period to the right of the start of the first one.
    Edges(Vec<Edge>),
}

impl Profile {
    /// A plane at height 0. The nominal period (µm) sets the spacing of the orders.
    ///
    /// # Errors
    /// A period that is not finite and positive.
    pub fn flat(period_um: f64) -> Result<Self, Error> {
        Self::sinusoid(period_um, 0.0)
    }

    /// The heights `height/2 · (1 + sin(2πx/period))` in µm. `height_um` is peak to valley, at least 0.
    ///
    /// # Errors
    /// A period that is not finite and positive, a height outside of 0 to twice the period.
    pub fn sinusoid(period_um: f64, height_um: f64) -> Result<Self, Error> {
        let height = accepted_height(period_um, height_um)?;
        // c_0 and c_1 of `Shape::Smooth`, from sin φ = Re(−i e^{iφ}).
        let harmonics = vec![Complex64::new(0.5 * height, 0.0), Complex64::new(0.0, -0.5 * height)];
        Ok(Self { period: period_um, shape: Shape::Smooth(harmonics) })
    }

    /// A sawtooth that rises along +x from 0 to `height_um`, and drops at the end of the period. Lengths are in µm.
    ///
    /// # Errors
    /// Errors of [`Profile::sinusoid`], and a wall above 0 but shorter than 1e-9 periods.
    pub fn blazed(period_um: f64, height_um: f64) -> Result<Self, Error> {
        let height = accepted_height(period_um, height_um)?;
        // A plane has no corners.
        if height == 0.0 {
            return Self::flat(period_um);
        }
        Self::polygon(period_um, &[[0.0, 0.0], [period_um, height]])
    }

    /// A rectangle: `height_um` over the fraction `duty` of the period from x = 0 on, and 0 over the rest.
    /// 0 < `duty` < 1.
    ///
    /// # Errors
    /// Errors of [`Profile::blazed`], a duty out of range, and a top or bottom shorter than 1e-9 periods.
    pub fn lamellar(period_um: f64, height_um: f64, duty: f64) -> Result<Self, Error> {
        let height = accepted_height(period_um, height_um)?;
        if !(duty > 0.0 && duty < 1.0) {
            return Err(Error::OutOfRange {
                quantity: "duty",
                found: duty,
                accepted: "between 0 and 1, both excluded",
            });
        }
        if height == 0.0 {
            return Self::flat(period_um);
        }
        let wall = duty * period_um;
        Self::polygon(period_um, &[[0.0, height], [wall, height], [wall, 0.0], [period_um, 0.0]])
    }

    /// Straight edges through `corners` (x, z) in µm. A last edge leads to the first corner moved by one period, unless
    /// the last corner is exactly there.
    ///
    /// x must not decrease from one corner to the next, nor exceed the x of the first corner by more than the period.
    /// The height is therefore a function of x, except at vertical walls.
    ///
    /// # Errors
    /// - [`Error::OutOfRange`]: a period that is not finite and positive, a relief deeper than twice the period.
    /// - [`Error::Profile`]: no corner or more than 64, corners that are not finite, x that decreases or exceeds the
    ///   period, edges shorter than 1e-9 periods.
    pub fn polygon(period_um: f64, corners: &[[f64; 2]]) -> Result<Self, Error> {
        positive("period in µm", period_um)?;
        let refuse = |found: String| {
            Err(Error::Profile {
                found,
                accepted: "1 to 64 finite, distinct corners whose x does not fall and stays within one period",
            })
        };
        if corners.is_empty() || corners.len() > CORNERS_MAX {
            return refuse(format!("{} corners", corners.len()));
        }
        let mut points: Vec<Point> = corners.to_vec();
        let end = [corners[0][0] + period_um, corners[0][1]];
        if corners[corners.len() - 1] != end {
            points.push(end);
        }
        for pair in points.windows(2) {
            let ([x0, z0], [x1, z1]) = (pair[0], pair[1]);
            let length = (x1 - x0).hypot(z1 - z0);
            if !length.is_finite() || x1 < x0 || length < EDGE_MIN * period_um {
                return refuse(format!("an edge from ({x0}, {z0}) to ({x1}, {z1})"));
            }
        }
        let edges = points.windows(2).map(|pair| Edge::line(pair[0], pair[1])).collect();
        Self::within_depth(period_um, Shape::Edges(edges))
    }

    /// The relief through sampled heights (µm) at the centres of at least 8 equal intervals of one period.
    ///
    /// Corners of two kinds, walls and kinks, are found in the heights:
    ///
    /// - A *vertical wall* is a single step between neighbouring samples that is steeper than 60°. Its angle differs by
    ///   more than 20° from the angles of the steps on either side. The wall stands halfway between both samples.
    /// - A *kink* is a sample where the slope's angle turns by more than 20°. The turn is also more than four times the
    ///   turns at the samples two places before and after, so a bend that the sampling resolves is no kink.
    /// - Between corners the relief is a straight edge, or, through at least 4 samples, a cubic spline where one of
    ///   them deviates from the straight edge by more than a thousandth of the relief's height.
    /// - Without corners the relief is the Fourier series of the heights. Its last coefficients are left out as long as
    ///   their magnitudes sum to at most 1e-4 of the largest one besides the mean.
    ///
    /// # Errors
    /// - [`Error::OutOfRange`]: a period that is not finite and positive, heights that are not finite, a relief deeper
    ///   than twice the period.
    /// - [`Error::Profile`]: fewer than 8 heights, more than 64 corners.
    pub fn samples(period_um: f64, heights_um: &[f64]) -> Result<Self, Error> {
        positive("period in µm", period_um)?;
        for &height in heights_um {
            finite("height in µm", height)?;
        }
        Self::within_depth(period_um, samples::shape(period_um, heights_um)?)
    }

    /// The profile of this shape.
    ///
    /// # Errors
    /// A height above twice the period.
    fn within_depth(period: f64, shape: Shape) -> Result<Self, Error> {
        let profile = Self { period, shape };
        accepted_height(period, profile.height_um())?;
        Ok(profile)
    }

    /// Period in µm.
    pub fn period_um(&self) -> f64 {
        self.period
    }

    /// Peak-to-valley height in µm.
    pub fn height_um(&self) -> f64 {
        let (low, high) = self
            .outline()
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p[1]), high.max(p[1])));
        high - low
    }

    /// Length of the curve over one period, in µm.
    pub fn arc_um(&self) -> f64 {
        self.outline().windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).sum()
    }

    /// Whether the profile consists of edges that meet in corners.
    pub fn has_corners(&self) -> bool {
        matches!(self.shape, Shape::Edges(_))
    }

    /// Points `[x, z]` in µm along the curve, in order, from which its length and height are measured.
    fn outline(&self) -> Vec<Point> {
        /// Equal steps along x, over the period of a smooth profile or over each edge. The relative error of the length
        /// falls as the inverse square of their number.
        const STEPS: usize = 256;
        match &self.shape {
            Shape::Smooth(harmonics) => (0..=STEPS)
                .map(|i| {
                    let fraction = i as f64 / STEPS as f64;
                    [fraction * self.period, smooth_height(harmonics, TAU * fraction)[0]]
                })
                .collect(),
            Shape::Edges(edges) => edges
                .iter()
                .flat_map(|edge| (0..=STEPS).map(move |i| edge.at(i as f64 / STEPS as f64).position))
                .collect(),
        }
    }
}

/// Height of a [`Shape::Smooth`] at a phase 2πx/period, and its first and second derivative with respect to the phase;
/// in µm.
pub(crate) fn smooth_height(harmonics: &[Complex64], phase: f64) -> [f64; 3] {
    let (mut height, mut slope, mut second) = (0.0, 0.0, 0.0);
    for (m, coefficient) in harmonics.iter().enumerate() {
        let m = m as f64;
        // The height is Re Σ c_m e^{im·phase}; a derivative multiplies its terms by im, and Re(i·term) = −Im(term).
        let term = coefficient * Complex64::cis((m * phase) % TAU);
        height += term.re;
        slope -= m * term.im;
        second -= m * m * term.re;
    }
    [height, slope, second]
}

/// Returns the height if it is between 0 and twice the period.
///
/// # Errors
/// A period that is not finite and positive, or another height.
fn accepted_height(period_um: f64, height_um: f64) -> Result<f64, Error> {
    positive("period in µm", period_um)?;
    if height_um.is_finite() && (0.0..=DEPTH_MAX * period_um).contains(&height_um) {
        Ok(height_um)
    } else {
        Err(Error::OutOfRange { quantity: "height in µm", found: height_um, accepted: "0 to twice the period" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn named_shapes_lie_as_documented() {
        let blazed = Profile::blazed(2.5, 0.25).unwrap();
        let Shape::Edges(edges) = &blazed.shape else { panic!("a sawtooth has corners") };
        assert_eq!(edges.len(), 2);
        assert_eq!(edges[0].at(0.5).position, [1.25, 0.125], "rises along +x");
        assert_eq!(edges[1].at(0.0).position, [2.5, 0.25]);
        let lamellar = Profile::lamellar(2.0, 0.3, 0.25).unwrap();
        let Shape::Edges(edges) = &lamellar.shape else { panic!("a rectangle has corners") };
        assert_eq!(edges.len(), 4);
        assert_eq!(edges[0].at(0.0).position, [0.0, 0.3], "high over the first part");
        assert_eq!(edges[1].at(0.0).position, [0.5, 0.3]);
        let sinusoid = Profile::sinusoid(2.0, 0.3).unwrap();
        let Shape::Smooth(harmonics) = &sinusoid.shape else { panic!("a sinusoid is smooth") };
        assert!((smooth_height(harmonics, 0.25 * TAU)[0] - 0.3).abs() < 1e-15);
        assert!((smooth_height(harmonics, 0.75 * TAU)[0]).abs() < 1e-15);
        assert!((sinusoid.height_um() - 0.3).abs() < 1e-12 && (blazed.height_um() - 0.25).abs() < 1e-12);
    }

    #[test]
    fn errors_name_the_refused_quantity() {
        let messages = [
            Profile::sinusoid(0.0, 0.1).unwrap_err().to_string(),
            Profile::sinusoid(1.0, f64::NAN).unwrap_err().to_string(),
            Profile::blazed(1.0, 2.5).unwrap_err().to_string(),
            Profile::lamellar(1.0, 0.1, 1.0).unwrap_err().to_string(),
            Profile::polygon(1.0, &[[0.0, 0.0], [0.6, 0.1], [0.5, 0.2]]).unwrap_err().to_string(),
            Profile::polygon(1.0, &[]).unwrap_err().to_string(),
            Profile::samples(1.0, &[0.0; 7]).unwrap_err().to_string(),
            Profile::samples(1.0, &[f64::INFINITY; 9]).unwrap_err().to_string(),
        ];
        for (message, named) in
            messages.iter().zip(["period", "height", "height", "duty", "edge", "0 corners", "7 heights", "height"])
        {
            assert!(message.contains(named) && message.contains("accepted"), "{message}");
        }
    }
}
