//! Points x, y, z on a regular grid, in any order.

use ndarray::Array2;

/// How far a coordinate may lie from its place on the grid, in steps of it: decimal numbers of few digits agree within.
const ON_GRID: f64 = 0.05;
/// Places of the grid for each point that is given, at most: beyond it, points are scattered rather than missing.
const PLACES_PER_POINT: usize = 4;

/// One axis of the grid.
struct Axis {
    first: f64,
    /// `None` where all points share one coordinate.
    step: Option<f64>,
    count: usize,
}

impl Axis {
    /// The grid that all of the coordinates lie on.
    fn of(name: char, coordinates: &[f64]) -> Result<Self, String> {
        let mut sorted = coordinates.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (first, last) = (sorted[0], sorted[sorted.len() - 1]);
        let extent = last - first;
        // Gaps far below the widest are the rounding of equal coordinates.
        let widest = sorted.windows(2).fold(0.0, |widest: f64, pair| widest.max(pair[1] - pair[0]));
        let mut gaps: Vec<f64> =
            sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|g| *g > 0.1 * widest).collect();
        if gaps.is_empty() {
            return Ok(Self { first, step: None, count: 1 });
        }
        gaps.sort_by(f64::total_cmp);
        // Where places are missing throughout, gaps are several steps wide: those near the median are single steps.
        let median = gaps[gaps.len() / 2];
        let single: Vec<f64> = gaps.into_iter().filter(|gap| (gap / median - 1.0).abs() < 0.4).collect();
        let steps = (extent * single.len() as f64 / single.iter().sum::<f64>()).round();
        // The mean over all steps is more exact than any one of them.
        let step = extent / steps;
        let off = |&&value: &&f64| {
            let place = (value - first) / step;
            (place - place.round()).abs() > ON_GRID
        };
        if let Some(value) = coordinates.iter().find(off) {
            return Err(format!(
                "{name} = {value} µm lies between the places of a grid of {step} µm: the points are not on a regular grid"
            ));
        }
        if steps > 1e9 {
            return Err(format!("along {name} its grid has {steps} steps, too many"));
        }
        Ok(Self { first, step: Some(step), count: steps as usize + 1 })
    }

    fn place(&self, value: f64) -> usize {
        self.step.map_or(0, |step| ((value - self.first) / step).round() as usize)
    }
}

/// Heights of points on a regular grid, the first row at the lowest y.
pub(super) struct Grid {
    /// Heights in the unit of z, NaN where there is no point.
    pub values: Array2<f64>,
    /// Spacing along x and y in µm; `None` for a single point.
    pub pixel_um: Option<(f64, f64)>,
}

/// Puts points, in any order, on their grid. Each has x and y in units of `xy_um` µm, and z in any.
///
/// # Errors
/// Points that are not on a regular grid, that share a place, or that fill too little of their grid.
pub(super) fn grid(points: &[f64], xy_um: [f64; 2]) -> Result<Grid, String> {
    let column = |at: usize, um: f64| -> Vec<f64> { points.chunks_exact(3).map(|row| row[at] * um).collect() };
    let (xs, ys, zs) = (column(0, xy_um[0]), column(1, xy_um[1]), column(2, 1.0));
    if let Some(at) = xs.iter().zip(&ys).position(|(x, y)| !(x.is_finite() && y.is_finite())) {
        return Err(format!("point {at} is at x = {}, y = {}; both must be finite", xs[at], ys[at]));
    }
    let (x, y) = (Axis::of('x', &xs)?, Axis::of('y', &ys)?);
    let places = x.count.checked_mul(y.count).filter(|places| *places <= PLACES_PER_POINT.saturating_mul(zs.len()));
    if places.is_none() {
        let (points, nx, ny) = (zs.len(), x.count, y.count);
        return Err(format!(
            "its {points} points fill little of a grid of {nx} × {ny}: they are not on a regular grid"
        ));
    }
    let mut values = Array2::from_elem((y.count, x.count), f64::NAN);
    let mut taken = Array2::from_elem((y.count, x.count), false);
    for ((px, py), pz) in xs.iter().zip(&ys).zip(&zs) {
        let at = [y.place(*py), x.place(*px)];
        if std::mem::replace(&mut taken[at], true) {
            return Err(format!("two points share the place x = {px}, y = {py}: they are not on a regular grid"));
        }
        values[at] = *pz;
    }
    // A single row or column is as wide as it is fine.
    let pixel_um = match (x.step, y.step) {
        (Some(dx), Some(dy)) => Some((dx, dy)),
        (Some(step), None) | (None, Some(step)) => Some((step, step)),
        (None, None) => None,
    };
    Ok(Grid { values, pixel_um })
}
