//! Cutting a rectangle out of a height field.

use super::{HeightField, HeightFieldError};
use ndarray::s;

/// Tolerance for rounding at the borders of the rectangle, in pixels: far above rounding errors, far below one pixel.
const ROUNDING_PIXELS: f64 = 1e-6;

impl HeightField {
    /// The part of the field in a rectangle of `width_um × height_um` whose lower left corner is at `(x_um, y_um)`.
    ///
    /// Pixels are kept if their centres lie in the rectangle or on its lower or left border. The field's own lower
    /// left corner, of lowest x and y, is (0, 0) here, so the first pixel's centre is at half a pixel along x and
    /// along y. In the indices of [`HeightField`] that centre is the origin.
    ///
    /// ```
    /// use sunbeam_height_field::Preset;
    ///
    /// let disc = Preset::Cd.build(None, None)?;
    /// let part = disc.cropped(10.0, 20.0, 32.0, 16.0)?;
    /// assert_eq!(part.extent_um(), (32.0, 16.0));
    /// # Ok::<(), sunbeam_height_field::HeightFieldError>(())
    /// ```
    ///
    /// # Errors
    /// [`HeightFieldError::Crop`] for a rectangle that is not finite, reaches beyond the field or holds no centre.
    pub fn cropped(&self, x_um: f64, y_um: f64, width_um: f64, height_um: f64) -> Result<Self, HeightFieldError> {
        let (nx, ny) = self.size();
        let (extent_x_um, extent_y_um) = self.extent_um();
        let refused = || HeightFieldError::Crop {
            x_um,
            y_um,
            size_x_um: width_um,
            size_y_um: height_um,
            extent_x_um,
            extent_y_um,
        };
        // Indices of the kept pixels along one axis of `count` pixels.
        let span = |start_um: f64, length_um: f64, step_um: f64, count: usize| {
            // Borders in pixels.
            let (start, end) = (start_um / step_um, (start_um + length_um) / step_um);
            let within = start >= -ROUNDING_PIXELS && end <= count as f64 + ROUNDING_PIXELS;
            // First pixel i whose centre, i + ½, is at or after the border, up to rounding.
            let first_from = |border: f64| (border - 0.5 - ROUNDING_PIXELS).ceil().max(0.0) as usize;
            let pixels = first_from(start)..first_from(end).min(count);
            if within && !pixels.is_empty() { Ok(pixels) } else { Err(refused()) }
        };
        let columns = span(x_um, width_um, self.dx_um, nx)?;
        let rows = span(y_um, height_um, self.dy_um, ny)?;
        Self::new(self.heights_um.slice(s![rows, columns]).to_owned(), self.dx_um, self.dy_um)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    /// A field of 6 × 4 pixels and 3 × 1 µm whose heights are `10 · row + column`.
    fn field() -> HeightField {
        HeightField::new(Array2::from_shape_fn((4, 6), |(iy, ix)| (10 * iy + ix) as f64), 0.5, 0.25).unwrap()
    }

    #[test]
    fn rectangles_are_in_um_from_the_lower_left_corner() {
        let cut = field().cropped(0.5, 0.25, 1.5, 0.5).unwrap();
        assert_eq!(cut.heights_um(), &ndarray::array![[11.0, 12.0, 13.0], [21.0, 22.0, 23.0]]);
        assert_eq!((cut.dx_um(), cut.dy_um()), (0.5, 0.25));
        assert_eq!(field().cropped(0.0, 0.0, 3.0, 1.0).unwrap(), field());
        // Borders between pixel centres.
        assert_eq!(field().cropped(0.3, 0.1, 0.6, 0.2).unwrap().heights_um(), &ndarray::array![[1.0]]);
    }

    #[test]
    fn rectangles_beyond_the_field_and_without_pixels_are_refused() {
        for (x, y, width, height) in [
            (-0.1, 0.0, 1.0, 0.5),
            (0.0, 0.0, 3.1, 1.0),
            (0.0, 0.8, 1.0, 0.25),
            (0.3, 0.0, 0.3, 1.0),
            (0.0, 0.0, 0.0, 1.0),
            (0.0, 0.0, -1.0, 1.0),
            (f64::NAN, 0.0, 1.0, 1.0),
            (0.0, 0.0, f64::INFINITY, 1.0),
        ] {
            let message = field().cropped(x, y, width, height).unwrap_err().to_string();
            assert!(message.contains("3 × 1 µm"), "{message}");
        }
    }
}
