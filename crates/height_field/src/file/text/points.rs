//! Points x, y, z on a regular grid, in any order.
//!
//! The grid is inferred from the coordinates. Along each axis, the number of steps is the extent divided by the typical
//! gap between sorted coordinates, to the nearest integer. The step is the extent divided by this number.

use ndarray::Array2;

/// Largest distance of a coordinate from its node, in steps. Files have coordinates of few decimals; larger distances
/// would accept scattered points.
const NODE_DISTANCE_MAX: f64 = 0.05;
/// Largest number of grid nodes for each given point. Beyond it points are scattered rather than missing.
const NODES_PER_POINT_MAX: usize = 4;
/// Largest gap between equal coordinates, which differ by rounding, as a fraction of the widest gap. The widest gap is
/// one step, or more where rows or columns of points are missing. At most eight neighbouring ones may be missing, since
/// with nine a step is no more than this fraction.
const EQUAL_GAP_MAX: f64 = 0.1;
/// Largest relative deviation of a single step from the median gap. It is below 1, since a gap at one missing node is
/// twice as wide.
const SINGLE_STEP_DEVIATION_MAX: f64 = 0.4;
/// Largest number of steps along an axis: far beyond any file, and exact as an integer.
const STEPS_MAX: f64 = 1e9;

/// One axis of the grid, in µm.
struct Axis {
    /// Lowest coordinate.
    first: f64,
    /// Distance between nodes; `None` if all points share one coordinate.
    step: Option<f64>,
    /// Number of nodes.
    count: usize,
}

impl Axis {
    /// The axis whose nodes match all `coordinates` (µm, at least one, finite); `name` appears in messages.
    ///
    /// # Errors
    /// Coordinates that are not at equal steps, or too many steps.
    fn of(name: char, coordinates: &[f64]) -> Result<Self, String> {
        let mut sorted = coordinates.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (first, last) = (sorted[0], sorted[sorted.len() - 1]);
        let extent = last - first;
        let widest = sorted.windows(2).fold(0.0, |widest: f64, pair| widest.max(pair[1] - pair[0]));
        // Smaller gaps are due to the rounding of equal coordinates.
        let mut gaps: Vec<f64> =
            sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > EQUAL_GAP_MAX * widest).collect();
        // Without a gap all coordinates are equal.
        if gaps.is_empty() {
            return Ok(Self { first, step: None, count: 1 });
        }
        gaps.sort_by(f64::total_cmp);
        // Gaps at missing nodes are several steps wide. Gaps near the median, among them itself, are single steps.
        let median = gaps[gaps.len() / 2];
        let single: Vec<f64> =
            gaps.into_iter().filter(|gap| (gap / median - 1.0).abs() < SINGLE_STEP_DEVIATION_MAX).collect();
        // Number of steps: the extent divided by the mean of the single steps.
        let steps = (extent * single.len() as f64 / single.iter().sum::<f64>()).round();
        // The extent divided by the number of steps has a smaller rounding error than any single step.
        let step = extent / steps;
        let is_off_grid = |&&value: &&f64| {
            let position = (value - first) / step;
            (position - position.round()).abs() > NODE_DISTANCE_MAX
        };
        if let Some(value) = coordinates.iter().find(is_off_grid) {
            return Err(format!(
                "{name} = {value} µm lies between the nodes of a grid of {step} µm: the points are not on a regular \
                 grid"
            ));
        }
        if steps > STEPS_MAX {
            return Err(format!("along {name} its grid has {steps} steps, too many"));
        }
        Ok(Self { first, step: Some(step), count: steps as usize + 1 })
    }

    /// Index of the node nearest to a coordinate.
    fn index(&self, value: f64) -> usize {
        self.step.map_or(0, |step| ((value - self.first) / step).round() as usize)
    }
}

/// Heights on a regular grid, with the first row at the lowest y.
pub(super) struct Grid {
    /// Heights in the unit of z; NaN at nodes without a point.
    pub values: Array2<f64>,
    /// Spacing along x and y in µm; `None` for a single point.
    pub pixel_um: Option<(f64, f64)>,
}

/// Sorts points into their grid. `points` holds x, y and z of each point in turn, for at least one point. x and y are
/// in units of `xy_um` µm, z is in any unit.
///
/// # Errors
/// Points that are not on a regular grid, that coincide, or that fill too few nodes.
pub(super) fn grid(points: &[f64], xy_um: [f64; 2]) -> Result<Grid, String> {
    // One coordinate of all points, multiplied by `unit`.
    let column =
        |index: usize, unit: f64| -> Vec<f64> { points.chunks_exact(3).map(|point| point[index] * unit).collect() };
    let (xs, ys, zs) = (column(0, xy_um[0]), column(1, xy_um[1]), column(2, 1.0));
    if let Some(at) = xs.iter().zip(&ys).position(|(x, y)| !(x.is_finite() && y.is_finite())) {
        return Err(format!("point {at} is at x = {}, y = {}; both must be finite", xs[at], ys[at]));
    }
    let (x, y) = (Axis::of('x', &xs)?, Axis::of('y', &ys)?);
    let nodes_max = NODES_PER_POINT_MAX.saturating_mul(zs.len());
    if x.count.checked_mul(y.count).is_none_or(|nodes| nodes > nodes_max) {
        let (points, nx, ny) = (zs.len(), x.count, y.count);
        return Err(format!(
            "its {points} points fill little of a grid of {nx} × {ny}: they are not on a regular grid"
        ));
    }
    let mut values = Array2::from_elem((y.count, x.count), f64::NAN);
    let mut taken = Array2::from_elem((y.count, x.count), false);
    for ((px, py), pz) in xs.iter().zip(&ys).zip(&zs) {
        let node = [y.index(*py), x.index(*px)];
        if std::mem::replace(&mut taken[node], true) {
            return Err(format!("two points share the node x = {px}, y = {py}: they are not on a regular grid"));
        }
        values[node] = *pz;
    }
    // A single row or column has square pixels.
    let pixel_um = match (x.step, y.step) {
        (Some(dx), Some(dy)) => Some((dx, dy)),
        (Some(step), None) | (None, Some(step)) => Some((step, step)),
        (None, None) => None,
    };
    Ok(Grid { values, pixel_um })
}
