//! An edge: a smooth piece of a profile's curve between two corners.

/// (x, z) in µm.
pub(crate) type Point = [f64; 2];

/// An edge: a straight line, which may be vertical, or a cubic spline z(x). The parameter u runs from 0 to 1, and x is
/// linear in u.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Edge {
    /// The point at u = 0.
    from: Point,
    /// The point at u = 1.
    to: Point,
    /// z(u); `None` for a straight line.
    spline: Option<Spline>,
}

/// A point of an edge and its derivatives with respect to u, in µm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgePoint {
    pub(crate) position: Point,
    /// First derivative.
    pub(crate) first: Point,
    /// Second derivative.
    pub(crate) second: Point,
}

impl Edge {
    /// The straight line between two points.
    pub(crate) fn line(from: Point, to: Point) -> Self {
        Self { from, to, spline: None }
    }

    /// The spline over x from `x0` to `x1` (µm) through at least two heights (µm) at the centres of equal intervals. It
    /// is extrapolated by half an interval at both ends, to `x0` and `x1`.
    pub(crate) fn spline(x0: f64, x1: f64, heights: &[f64]) -> Self {
        let spline = Spline::new(heights);
        let (from, to) = ([x0, spline.at(0.0)[0]], [x1, spline.at(1.0)[0]]);
        Self { from, to, spline: Some(spline) }
    }

    /// Whether the edge is a straight line.
    pub(crate) fn is_straight(&self) -> bool {
        self.spline.is_none()
    }

    /// The points at u = 0 and at u = 1.
    pub(crate) fn ends(&self) -> [Point; 2] {
        [self.from, self.to]
    }

    /// Distance between the ends, in µm.
    pub(crate) fn chord(&self) -> f64 {
        (self.to[0] - self.from[0]).hypot(self.to[1] - self.from[1])
    }

    /// Position and derivatives at u.
    pub(crate) fn at(&self, u: f64) -> EdgePoint {
        let along = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        match &self.spline {
            None => EdgePoint { position: [0, 1].map(|i| self.from[i] + along[i] * u), first: along, second: [0.0; 2] },
            Some(spline) => {
                let [z, dz, ddz] = spline.at(u);
                EdgePoint { position: [self.from[0] + along[0] * u, z], first: [along[0], dz], second: [0.0, ddz] }
            }
        }
    }
}

/// A cubic spline over u in [0, 1] with n ≥ 2 knots at (i + ½)/n. Its second derivative is constant on the first and on
/// the last interval between knots.
#[derive(Clone, Debug, PartialEq)]
struct Spline {
    /// Heights at the knots, in µm.
    heights: Vec<f64>,
    /// Second derivatives with respect to u at the knots, in µm.
    second_derivatives: Vec<f64>,
}

impl Spline {
    /// The spline through `heights` at the knots; a straight line if there are two.
    fn new(heights: &[f64]) -> Self {
        let n = heights.len();
        let step = 1.0 / n as f64;
        // The second derivatives M satisfy M[i−1] + 4 M[i] + M[i+1] = 6(h[i−1] − 2h[i] + h[i+1])/step² at the inner
        // knots, with M[0] = M[1] and M[n−1] = M[n−2]. The tridiagonal system is solved by Thomas' algorithm.
        let mut second_derivatives = vec![0.0; n];
        if n >= 3 {
            let inner = n - 2;
            // After elimination, row i reads M[i+1] + upper[i]·M[i+2] = right[i]. The conditions at the ends add 1 to
            // the diagonal of the first and of the last row.
            let (mut upper, mut right) = (vec![0.0; inner], vec![0.0; inner]);
            for i in 0..inner {
                let difference = heights[i] - 2.0 * heights[i + 1] + heights[i + 2];
                let mut diagonal = 4.0 + f64::from(i == 0) + f64::from(i == inner - 1);
                let mut value = 6.0 * difference / (step * step);
                // Subtracts row i − 1, which eliminates M[i].
                if i > 0 {
                    diagonal -= upper[i - 1];
                    value -= right[i - 1];
                }
                upper[i] = 1.0 / diagonal;
                right[i] = value / diagonal;
            }
            // Back substitution, from the last row, which has no M[i+2].
            for i in (0..inner).rev() {
                let known = if i + 1 < inner { upper[i] * second_derivatives[i + 2] } else { 0.0 };
                second_derivatives[i + 1] = right[i] - known;
            }
            second_derivatives[0] = second_derivatives[1];
            second_derivatives[n - 1] = second_derivatives[n - 2];
        }
        Self { heights: heights.to_vec(), second_derivatives }
    }

    /// Height at u, and its first and second derivative with respect to u, all in µm.
    fn at(&self, u: f64) -> [f64; 3] {
        let n = self.heights.len();
        let step = 1.0 / n as f64;
        let i = (u * n as f64 - 0.5).floor().clamp(0.0, (n - 2) as f64) as usize;
        // Fraction of the interval from knot i to knot i + 1; outside of [0, 1] beyond the outer knots.
        let fraction = u * n as f64 - 0.5 - i as f64;
        let (h0, h1) = (self.heights[i], self.heights[i + 1]);
        let (m0, m1) = (self.second_derivatives[i], self.second_derivatives[i + 1]);
        // Slope of the cubic at knot i, from the heights and second derivatives at both knots.
        let slope_at_knot = (h1 - h0) / step - step / 6.0 * (2.0 * m0 + m1);
        // Taylor's series about knot i at the distance s = step·fraction. The third derivative is (m1 − m0)/step, and
        // its product with s is (m1 − m0)·fraction.
        let s = step * fraction;
        let height = h0 + s * (slope_at_knot + s * (0.5 * m0 + (m1 - m0) * fraction / 6.0));
        let slope = slope_at_knot + s * (m0 + 0.5 * (m1 - m0) * fraction);
        let second = m0 + (m1 - m0) * fraction;
        [height, slope, second]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spline_reproduces_a_parabola() {
        let height = |u: f64| 0.3 - 0.7 * u + 0.4 * u * u;
        let heights: Vec<f64> = (0..9).map(|i| height((f64::from(i) + 0.5) / 9.0)).collect();
        let edge = Edge::spline(1.0, 2.0, &heights);
        for i in 0..=20 {
            let u = f64::from(i) / 20.0;
            let point = edge.at(u);
            // Rounding, which grows with the number of intervals in each derivative.
            assert!((point.position[1] - height(u)).abs() < 1e-14);
            assert!((point.first[1] - (0.8 * u - 0.7)).abs() < 1e-13 && (point.second[1] - 0.8).abs() < 1e-12);
        }
    }
}
