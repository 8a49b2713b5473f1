//! Levelling, and basic statistics of a relief.

use super::{HeightField, HeightFieldError};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Surface that is subtracted from a height field before use.
///
/// ```
/// use sunbeam_height_field::{Level, Preset};
///
/// let blazed = Preset::Blazed.build(None, None)?;
/// assert!(blazed.levelled(Level::Mean).mean_um().abs() < 1e-12);
/// assert_eq!("lines".parse::<Level>()?, Level::Lines);
/// # Ok::<(), sunbeam_height_field::HeightFieldError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Nothing.
    #[default]
    None,
    /// The mean height.
    Mean,
    /// The least-squares plane: mean and tilt.
    Plane,
    /// The least-squares surface of second degree: mean, tilt, and the bow of a scanner.
    Quadratic,
    /// The plane, and then the median height of every row.
    ///
    /// Removes offsets between lines of a scan along x, and with them the part of the relief that varies along y alone.
    Lines,
}

impl Level {
    /// Every level, in the order in which messages list them.
    pub const ALL: [Self; 5] = [Self::None, Self::Mean, Self::Plane, Self::Quadratic, Self::Lines];

    /// The name used on command lines and in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Mean => "mean",
            Self::Plane => "plane",
            Self::Quadratic => "quadratic",
            Self::Lines => "lines",
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Level {
    type Err = HeightFieldError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|level| level.name() == name).ok_or_else(|| HeightFieldError::UnknownName {
            parameter: "level",
            found: name.to_owned(),
            accepted: Self::ALL.map(Self::name).join(", "),
        })
    }
}

impl HeightField {
    /// The relief minus the surface that `level` names, fitted in height (along z).
    ///
    /// The middle of the height range is subtracted first, so that sums run over small numbers. Even an offset of a
    /// millimetre then adds no error beyond the rounding of the heights themselves. An axis of one pixel has no tilt.
    #[must_use]
    pub fn levelled(&self, level: Level) -> Self {
        let mut field = self.clone();
        if level == Level::None {
            return field;
        }
        let (lowest, highest) = self.range_um();
        let mid = lowest + 0.5 * (highest - lowest);
        field.heights_um.mapv_inplace(|h| h - mid);
        let mean = field.mean_um();
        field.heights_um.mapv_inplace(|h| h - mean);
        if level == Level::Mean {
            return field;
        }
        // Over a rectangular grid both tilts are orthogonal to each other and to the mean, so each is fitted by itself.
        field.subtract_fit(|x, _| x);
        field.subtract_fit(|_, y| y);
        match level {
            Level::None | Level::Mean | Level::Plane => {}
            Level::Quadratic => {
                let (nx, ny) = self.size();
                // Mean of x² over n pixels, with x counted from the centre. Squares minus their means are orthogonal to
                // the mean, the tilts and each other.
                let mean_square = |n: usize| ((n * n) as f64 - 1.0) / 12.0;
                let (mean_x2, mean_y2) = (mean_square(nx), mean_square(ny));
                field.subtract_fit(|x, y| x * y);
                field.subtract_fit(|x, _| x * x - mean_x2);
                field.subtract_fit(|_, y| y * y - mean_y2);
            }
            Level::Lines => {
                for mut row in field.heights_um.rows_mut() {
                    let mut sorted = row.to_vec();
                    sorted.sort_by(f64::total_cmp);
                    // For an odd number of pixels, both are the middle height.
                    let (below, above) = (sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
                    let median = 0.5 * (below + above);
                    row.mapv_inplace(|h| h - median);
                }
            }
        }
        field
    }

    /// Subtracts the least-squares multiple of `basis(x, y)`. Here x and y are column and row in pixels, counted from
    /// the centre of the field.
    ///
    /// Nothing is subtracted if the basis is zero at all pixels, as a tilt along an axis of one pixel or a bow along an
    /// axis of two is. Such zeros are exact: with so few pixels nothing is rounded.
    fn subtract_fit(&mut self, basis: impl Fn(f64, f64) -> f64) {
        let (nx, ny) = self.size();
        let (cx, cy) = (0.5 * (nx as f64 - 1.0), 0.5 * (ny as f64 - 1.0));
        let value = |iy: usize, ix: usize| basis(ix as f64 - cx, iy as f64 - cy);
        let (mut projection, mut squares) = (0.0, 0.0);
        for ((iy, ix), h) in self.heights_um.indexed_iter() {
            let b = value(iy, ix);
            projection += b * h;
            squares += b * b;
        }
        if squares > 0.0 {
            let factor = projection / squares;
            for ((iy, ix), h) in self.heights_um.indexed_iter_mut() {
                *h -= factor * value(iy, ix);
            }
        }
    }

    /// Mean height in µm, summed over differences from the middle of the range, so that an offset costs no digits.
    pub fn mean_um(&self) -> f64 {
        let (lowest, highest) = self.range_um();
        let mid = lowest + 0.5 * (highest - lowest);
        mid + self.heights_um.iter().map(|h| h - mid).sum::<f64>() / self.heights_um.len() as f64
    }

    /// Root mean square height about the mean, in µm, without levelling.
    pub fn rms_um(&self) -> f64 {
        let mean = self.mean_um();
        (self.heights_um.iter().map(|h| (h - mean) * (h - mean)).sum::<f64>() / self.heights_um.len() as f64).sqrt()
    }

    /// Highest minus lowest height in µm.
    pub fn peak_to_valley_um(&self) -> f64 {
        let (lowest, highest) = self.range_um();
        highest - lowest
    }

    /// Root mean square slopes along x and along y (dimensionless), from differences of neighbouring pixels inside the
    /// field. The slope along an axis of one pixel is 0.
    pub fn rms_slope(&self) -> (f64, f64) {
        let (nx, ny) = self.size();
        let h = &self.heights_um;
        let rms = |sum: f64, count: usize, step: f64| if count > 0 { (sum / count as f64).sqrt() / step } else { 0.0 };
        // Sums of squared differences in µm².
        let (mut sx, mut sy) = (0.0, 0.0);
        for ((iy, ix), &value) in h.indexed_iter() {
            if ix + 1 < nx {
                sx += (h[[iy, ix + 1]] - value).powi(2);
            }
            if iy + 1 < ny {
                sy += (h[[iy + 1, ix]] - value).powi(2);
            }
        }
        (rms(sx, (nx - 1) * ny, self.dx_um), rms(sy, nx * (ny - 1), self.dy_um))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array2;

    /// Rounding of sums over a few thousand heights of order 1 µm.
    const ROUNDING_UM: f64 = 1e-14;
    /// Rounding of heights at an offset of 1000 µm, where f64 has a spacing of 1.1e-13 µm.
    const ROUNDING_AT_1_MM_UM: f64 = 3e-13;

    /// Heights in µm, up to 0.3 µm, without symmetry along x or y.
    fn relief(ix: usize, iy: usize) -> f64 {
        0.3 * ((ix * 7 + iy * 13) % 11) as f64 / 11.0
    }

    /// The relief plus an offset in µm and tilts in µm per pixel.
    fn field(offset: f64, tilt_x: f64, tilt_y: f64) -> HeightField {
        let heights = Array2::from_shape_fn((37, 53), |(iy, ix)| {
            offset + relief(ix, iy) + tilt_x * ix as f64 + tilt_y * iy as f64
        });
        HeightField::new(heights, 0.1, 0.2).unwrap()
    }

    fn largest_difference(a: &HeightField, b: &HeightField) -> f64 {
        (a.heights_um() - b.heights_um()).iter().fold(0.0, |m, d| m.max(d.abs()))
    }

    #[test]
    fn levels_subtract_mean_and_plane() {
        let plain = field(0.0, 0.0, 0.0);
        let tilted = field(0.0, 0.01, -0.02);
        assert!(largest_difference(&plain.levelled(Level::Plane), &tilted.levelled(Level::Plane)) < ROUNDING_UM);
        assert!(plain.levelled(Level::Mean).mean_um().abs() < ROUNDING_UM);
        assert_eq!(plain.levelled(Level::None), plain);
        let pure =
            HeightField::new(Array2::from_shape_fn((5, 3), |(y, x)| x as f64 - 2.0 * y as f64), 1.0, 1.0).unwrap();
        assert!(pure.levelled(Level::Plane).rms_um() < ROUNDING_UM);
    }

    #[test]
    fn plane_is_the_least_squares_plane() {
        let levelled = field(0.0, 0.01, -0.02).levelled(Level::Plane);
        let mut moments = [0.0; 3];
        for ((iy, ix), h) in levelled.heights_um().indexed_iter() {
            moments[0] += h;
            moments[1] += h * ix as f64;
            moments[2] += h * iy as f64;
        }
        // Normal equations: the residual is orthogonal to 1, x and y; 2000 terms of size 50.
        assert!(moments.iter().all(|m| m.abs() < 1e-10), "{moments:?}");
    }

    #[test]
    fn offset_of_a_millimetre_adds_only_rounding() {
        let (near, far) = (field(0.0, 0.01, 0.0), field(1000.0, 0.01, 0.0));
        for level in [Level::Mean, Level::Plane] {
            assert!(largest_difference(&near.levelled(level), &far.levelled(level)) < ROUNDING_AT_1_MM_UM);
        }
        assert!((near.rms_um() - far.rms_um()).abs() < ROUNDING_AT_1_MM_UM);
    }

    #[test]
    fn fields_of_one_pixel_or_one_row_are_levelled() {
        let one = HeightField::new(Array2::from_elem((1, 1), 5.0), 1.0, 1.0).unwrap();
        assert_eq!(one.levelled(Level::Plane).heights_um()[[0, 0]], 0.0);
        assert_eq!(one.rms_slope(), (0.0, 0.0));
        let row = HeightField::new(Array2::from_shape_fn((1, 9), |(_, x)| 0.5 * x as f64), 0.5, 1.0).unwrap();
        assert!(row.levelled(Level::Plane).rms_um() < ROUNDING_UM);
        assert_eq!(row.rms_slope(), (1.0, 0.0));
    }

    #[test]
    fn quadratic_level_subtracts_the_least_squares_bow() {
        let bowed = |strength: f64| {
            let heights = Array2::from_shape_fn((31, 45), |(iy, ix)| {
                let (x, y) = (ix as f64 / 45.0, iy as f64 / 31.0);
                relief(ix, iy) + strength * (3.0 * x * x - 2.0 * x * y + y * y + x - 0.5)
            });
            HeightField::new(heights, 0.1, 0.2).unwrap().levelled(Level::Quadratic)
        };
        let levelled = bowed(1.0);
        assert!(largest_difference(&bowed(0.0), &levelled) < 10.0 * ROUNDING_UM);
        // Exponents of x and y in the terms of degree 0 to 2.
        for (px, py) in [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)] {
            let moment: f64 = levelled
                .heights_um()
                .indexed_iter()
                .map(|((iy, ix), h)| h * (ix as f64 / 45.0).powi(px) * (iy as f64 / 31.0).powi(py))
                .sum();
            // Normal equations: 1400 terms of size 1.
            assert!(moment.abs() < 1e-11, "{px} {py}: {moment}");
        }
        // A row of two pixels has a tilt, but no bow.
        let pair = HeightField::new(ndarray::array![[0.0, 2.0]], 1.0, 1.0).unwrap();
        assert!(pair.levelled(Level::Quadratic).rms_um() < ROUNDING_UM);
    }

    #[test]
    fn lines_level_subtracts_line_offsets() {
        let plain = HeightField::new(Array2::from_shape_fn((20, 40), |(_, x)| relief(x, 0)), 0.1, 0.1).unwrap();
        let offset = |iy: usize| 0.2 * ((iy * 5) % 7) as f64;
        let scanned = HeightField::new(
            Array2::from_shape_fn((20, 40), |(iy, ix)| relief(ix, 0) + offset(iy) + 0.01 * ix as f64),
            0.1,
            0.1,
        )
        .unwrap();
        let difference = largest_difference(&plain.levelled(Level::Lines), &scanned.levelled(Level::Lines));
        // Offsets change the plane along y alone, which the medians of rows remove with the offsets. The fit to heights
        // of up to 1.9 µm costs more rounding than a mean.
        assert!(difference < 10.0 * ROUNDING_UM, "{difference}");
    }

    #[test]
    fn names_round_trip() {
        for level in Level::ALL {
            assert_eq!(level.name().parse::<Level>().unwrap(), level);
        }
        let message = "tilt".parse::<Level>().unwrap_err().to_string();
        assert!(message.contains("tilt") && message.contains("none, mean, plane, quadratic, lines"), "{message}");
    }
}
