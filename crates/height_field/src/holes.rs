//! Detection of points without a height.
//!
//! A point is missing where its number is NaN, infinite, of magnitude 1e30 or more, or *isolated*: far from all other
//! numbers, such as −9999 (`isolated.rs`). Missing points are first marked as NaN, then replaced (`fill.rs`, `film.rs`)
//! or refused.

use super::isolated::isolated;
use super::{Fill, HeightField, HeightFieldError, check_pixel_size};
use ndarray::Array2;

/// Magnitude from which a number marks a missing point, as stored or in µm. Many programs write such numbers where
/// nothing was measured; no height in any unit is as large.
const MISSING_MAGNITUDE: f64 = 1e30;

/// `number`, or NaN if it marks a missing point by itself: NaN, infinities, and magnitudes from [`MISSING_MAGNITUDE`]
/// on.
pub(crate) fn known_or_nan(number: f64) -> f64 {
    // NaN fails the comparison.
    if number.abs() < MISSING_MAGNITUDE { number } else { f64::NAN }
}

/// Points without a height, as found before they are filled.
pub(crate) struct Holes {
    /// Number of missing points.
    pub count: usize,
    /// Row and column, from 0, of the first missing point in row-major order; `None` without missing points.
    pub first: Option<(usize, usize)>,
    /// Numbers recognised as missing by their distance from all heights (`isolated.rs`), each with its count.
    pub isolated: Vec<(f64, usize)>,
}

impl Holes {
    /// Replaces the marks of missing points in `values` by NaN: infinities, magnitudes from [`MISSING_MAGNITUDE`] on,
    /// as stored or in µm, and isolated numbers. `unit_um` is the unit of `values` in µm.
    pub(crate) fn mark(values: &mut Array2<f64>, unit_um: f64) -> Self {
        let is_missing = |value: f64| known_or_nan(value).is_nan() || known_or_nan(value * unit_um).is_nan();
        values.mapv_inplace(|value| if is_missing(value) { f64::NAN } else { value });
        let isolated = isolated(values);
        if !isolated.is_empty() {
            let is_isolated = |value: f64| isolated.iter().any(|(number, _)| *number == value);
            values.mapv_inplace(|value| if is_isolated(value) { f64::NAN } else { value });
        }
        let mut missing = values.indexed_iter().filter(|(_, v)| v.is_nan()).map(|(at, _)| at);
        let first = missing.next();
        let count = first.map_or(0, |_| 1 + missing.count());
        Self { count, first, isolated }
    }

    /// The isolated numbers as clauses that continue a message about the missing points, such as `; 3 of them -9999,
    /// isolated from the rest`; empty without such numbers.
    pub(crate) fn isolated_note(&self) -> String {
        let clause = |(value, count): &(f64, usize)| format!("; {count} of them {value}, isolated from the rest");
        self.isolated.iter().map(clause).collect()
    }
}

impl HeightField {
    /// [`HeightField::new`] with missing points, which `fill` replaces.
    ///
    /// Missing points are NaN, infinite, of magnitude 1e30 or more, or a number isolated from all heights (such as
    /// −9999).
    ///
    /// # Errors
    /// [`HeightFieldError::Holes`] for missing points with [`Fill::None`], or if all points are missing. Errors of
    /// [`HeightField::new`].
    pub fn with_holes(
        mut heights_um: Array2<f64>,
        dx_um: f64,
        dy_um: f64,
        fill: Fill,
    ) -> Result<Self, HeightFieldError> {
        let holes = Holes::mark(&mut heights_um, 1.0);
        if let Some((row, column)) = holes.first {
            let (count, total) = (holes.count, heights_um.len());
            if fill == Fill::None || count == total {
                let isolated_note = holes.isolated_note();
                return Err(HeightFieldError::Holes { count, total, row, column, isolated_note });
            }
            // `Fill::Laplace` divides by the pixel sizes, so they are checked before `new` checks them again.
            check_pixel_size(dx_um, dy_um)?;
            fill.apply(&mut heights_um, dx_um, dy_um);
        }
        Self::new(heights_um, dx_um, dy_um)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn holes_are_refused_or_filled() {
        let plane = Array2::from_shape_fn((4, 5), |(iy, ix)| 0.5 * iy as f64 - 0.25 * ix as f64);
        for hole in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e30, -3e38, -999.0] {
            let mut heights = plane.clone();
            heights[[1, 2]] = hole;
            let refused = HeightField::with_holes(heights.clone(), 0.1, 0.2, Fill::None).unwrap_err().to_string();
            assert!(refused.contains("1 of 20") && refused.contains("row 1, column 2; `fill`"), "{refused}");
            // A plane solves Laplace's equation, which is solved to a residual of 1e-12 of heights up to 2 µm.
            let laplace = HeightField::with_holes(heights.clone(), 0.1, 0.2, Fill::Laplace).unwrap();
            assert!((laplace.heights_um()[[1, 2]] - plane[[1, 2]]).abs() < 1e-11);
            let mean = HeightField::with_holes(heights, 0.1, 0.2, Fill::Mean).unwrap();
            let known = (plane.sum() - plane[[1, 2]]) / 19.0;
            assert!((mean.heights_um()[[1, 2]] - known).abs() < 1e-14);
        }
        assert_eq!(HeightField::with_holes(plane.clone(), 0.1, 0.2, Fill::Laplace).unwrap().heights_um(), plane);
    }

    #[test]
    fn arrays_without_heights_are_refused() {
        let refused = HeightField::with_holes(array![[f64::NAN, f64::NAN]], 0.1, 0.1, Fill::Mean);
        assert!(matches!(refused, Err(HeightFieldError::Holes { count: 2, total: 2, row: 0, column: 0, .. })));
    }

    #[test]
    fn pixel_sizes_are_checked_before_holes_are_filled() {
        let refused = HeightField::with_holes(array![[f64::NAN, 1.0]], 0.0, 0.1, Fill::Laplace);
        assert!(matches!(refused, Err(HeightFieldError::PixelSize { axis: "x", .. })));
    }
}
