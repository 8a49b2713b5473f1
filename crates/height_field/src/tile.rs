//! Seams of a repeated tile: their measure, and blending of edges so that a scan repeats without a seam.
//!
//! A *seam* is the step in height between the last pixel of a tile and the first pixel of its next copy.
//!
//! Blending along one axis, in pixels: the tile is the first `length` pixels of the axis. The strip of `strip` pixels
//! beyond the tile is blended over the tile's first `strip` pixels. The weight of the strip beyond falls from nearly
//! 1 at pixel 0 to nearly 0 at pixel `strip − 1`. The tile's last pixel then continues into its first. The *mismatch*
//! of a length is the root of the sum of squared differences between both strips.

use super::{HeightField, HeightFieldError};
use ndarray::{Array2, Axis, s};
use serde::Serialize;
use std::f64::consts::PI;

/// Fraction of each axis that is blended if no width is given. A wider strip changes more of the relief; a narrower one
/// makes steeper transitions.
const BLEND_FRACTION: f64 = 0.1;
/// Smallest length of an axis as a multiple of the strip's width; wider strips are refused. With a multiple of two,
/// both strips could overlap.
const STRIPS_MIN: usize = 3;
/// Reciprocal of the largest fraction by which the search shortens the longest length, the axis without the strip. With
/// at least this many periods in the longest length, that fraction is one period or more, so the search meets a whole
/// number of periods. A smaller value may cut off more of the scan; a larger one misses reliefs with fewer periods.
const PERIODS_MIN: usize = 3;
/// Tolerance on the mismatch, as a fraction of the largest mismatch. Lengths whose mismatch exceeds the least by at
/// most this tolerance are accepted. The longest of them is then shortened until its mismatch is a local minimum. A
/// larger tolerance keeps more pixels and matches worse.
const MISMATCH_TOLERANCE: f64 = 0.1;

/// Steps in height across the seam of a repeated tile, along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Seam {
    /// Root mean square of the difference between the first pixel and the last, over all lines along the axis, in µm.
    pub seam_rms_um: f64,
    /// Root mean square of the difference between neighbours within the field along the axis, in µm.
    pub inside_rms_um: f64,
    /// `seam_rms_um / inside_rms_um`: about 1 for a tile without a visible seam; `None` if all neighbours are equal.
    pub ratio: Option<f64>,
}

/// Seams along both axes; `None` along an axis of one pixel, which always repeats.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Seams {
    /// Seam between the last and the first column.
    pub x: Option<Seam>,
    /// Seam between the last and the first row.
    pub y: Option<Seam>,
}

/// Changes that [`HeightField::made_tileable`] made to a field.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TileReport {
    /// Lengths that were cut off along x and y, including the blended strips, in µm.
    pub cut_um: [f64; 2],
    /// Widths of the blended strips along x and y, in µm; 0 along an axis of one pixel.
    pub blend_um: [f64; 2],
    /// Fraction of the tile's pixels that were blended.
    pub blended_share: f64,
    /// Root mean square change of the blended pixels, in µm.
    pub rms_change_um: f64,
    /// Root mean square heights in µm: of the kept part before blending, and of the tile. Blending edges that do not
    /// match lowers that of the tile.
    pub rms_um: [f64; 2],
    /// Seams of the whole field before blending.
    pub seams_before: Seams,
    /// Seams of the tile.
    pub seams_after: Seams,
}

impl HeightField {
    /// Seams of the field if it is repeated unchanged. A tilt makes a seam, so level first.
    pub fn seams(&self) -> Seams {
        Seams { x: seam(&self.heights_um, Axis(1)), y: seam(&self.heights_um, Axis(0)) }
    }

    /// A tile of the relief that repeats without a seam, and a report of the changes.
    ///
    /// Along each axis, x first, the strip of `blend_um` beyond the tile's end is blended over the tile's beginning
    /// with a raised cosine. The end then continues into the beginning. Other heights stay unchanged. Without
    /// `blend_um`, a tenth of each axis is blended, and at least a pixel.
    ///
    /// The length of the tile is chosen so that both strips match. For a periodic relief this is a whole number of
    /// periods. Lengths from two thirds of the axis (without the strip) on are tried. Of all that match nearly equally
    /// well, the longest is taken, or the next shorter one that matches better than its neighbours.
    ///
    /// ```
    /// use ndarray::Array2;
    /// use sunbeam_height_field::HeightField;
    ///
    /// // 6.5 periods of 20 pixels: six are kept.
    /// let wave = |(_, ix): (usize, usize)| (std::f64::consts::TAU * ix as f64 / 20.0).sin();
    /// let field = HeightField::new(Array2::from_shape_fn((8, 130), wave), 0.1, 0.1)?;
    /// let (tile, report) = field.made_tileable(Some(0.1))?;
    /// assert_eq!(tile.size().0, 120);
    /// assert!(report.rms_change_um < 1e-12);
    /// # Ok::<(), sunbeam_height_field::HeightFieldError>(())
    /// ```
    ///
    /// # Errors
    /// [`HeightFieldError::Blend`] if, along an axis of several pixels, the width rounds to no pixel or to more than a
    /// third of the pixels: always along an axis of two.
    pub fn made_tileable(&self, blend_um: Option<f64>) -> Result<(Self, TileReport), HeightFieldError> {
        let (nx, ny) = self.size();
        let (extent_x, extent_y) = self.extent_um();
        // Width of the strip in pixels; 0 along an axis of one pixel.
        let strip_pixels = |axis, count: usize, pixel_um: f64, extent_um: f64| {
            let width_um = blend_um.unwrap_or((BLEND_FRACTION * extent_um).max(pixel_um));
            let pixels = (width_um / pixel_um).round();
            match count {
                1 => Ok(0),
                _ if pixels >= 1.0 && pixels <= count as f64 / STRIPS_MIN as f64 => Ok(pixels as usize),
                _ => Err(HeightFieldError::Blend { axis, width_um, extent_um }),
            }
        };
        let strip_x = strip_pixels("x", nx, self.dx_um, extent_x)?;
        let strip_y = strip_pixels("y", ny, self.dy_um, extent_y)?;
        // Blending along y is blending along x of the transpose.
        let along_x = blended(&self.heights_um, strip_x);
        let heights = blended(&along_x.t().to_owned(), strip_y).t().as_standard_layout().into_owned();
        let tile = Self { heights_um: heights, dx_um: self.dx_um, dy_um: self.dy_um };

        let (kept_x, kept_y) = tile.size();
        let kept = Self { heights_um: self.heights_um.slice(s![..kept_y, ..kept_x]).to_owned(), ..tile.clone() };
        // Pixels in either strip.
        let blended_count = kept_x * kept_y - (kept_x - strip_x) * (kept_y - strip_y);
        let squares: f64 =
            tile.heights_um.iter().zip(&kept.heights_um).map(|(after, h)| (after - h) * (after - h)).sum();
        let report = TileReport {
            cut_um: [(nx - kept_x) as f64 * self.dx_um, (ny - kept_y) as f64 * self.dy_um],
            blend_um: [strip_x as f64 * self.dx_um, strip_y as f64 * self.dy_um],
            blended_share: blended_count as f64 / (kept_x * kept_y) as f64,
            rms_change_um: (squares / blended_count.max(1) as f64).sqrt(),
            rms_um: [kept.rms_um(), tile.rms_um()],
            seams_before: self.seams(),
            seams_after: tile.seams(),
        };
        Ok((tile, report))
    }
}

/// The seam along an axis; `None` for an axis of one pixel.
fn seam(heights: &Array2<f64>, axis: Axis) -> Option<Seam> {
    let count = heights.len_of(axis);
    if count < 2 {
        return None;
    }
    // Mean square difference between two lines across the axis, in µm².
    let mean_square = |a: usize, b: usize| {
        let (a, b) = (heights.index_axis(axis, a), heights.index_axis(axis, b));
        a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / a.len() as f64
    };
    let inside = (1..count).map(|i| mean_square(i - 1, i)).sum::<f64>() / (count - 1) as f64;
    let (seam_rms_um, inside_rms_um) = (mean_square(count - 1, 0).sqrt(), inside.sqrt());
    Some(Seam { seam_rms_um, inside_rms_um, ratio: (inside_rms_um > 0.0).then(|| seam_rms_um / inside_rms_um) })
}

/// The tile of the best length along x with a blended strip of `strip` pixels; unchanged for a strip of 0.
fn blended(heights: &Array2<f64>, strip: usize) -> Array2<f64> {
    if strip == 0 {
        return heights.clone();
    }
    let (ny, length) = (heights.nrows(), best_length(heights, strip));
    Array2::from_shape_fn((ny, length), |(iy, ix)| {
        let own = heights[[iy, ix]];
        if ix >= strip {
            return own;
        }
        // Weight of the tile's own height: a raised cosine at the centre of the pixel.
        let own_weight = 0.5 - 0.5 * (PI * (ix as f64 + 0.5) / strip as f64).cos();
        own_weight * own + (1.0 - own_weight) * heights[[iy, length + ix]]
    })
}

/// Number of pixels along x of the tile whose strips of `strip` pixels match, chosen as [`HeightField::made_tileable`]
/// describes. `strip` is 1 to a third of the pixels along x.
fn best_length(heights: &Array2<f64>, strip: usize) -> usize {
    let mismatch = |length: usize| -> f64 {
        let (beginning, beyond) = (heights.slice(s![.., ..strip]), heights.slice(s![.., length..length + strip]));
        beginning.iter().zip(beyond).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    let longest = heights.ncols() - strip;
    // At least 4/9 of the axis: two thirds of the rest beside a strip of a third. This exceeds `strip`, so the strips
    // do not overlap.
    let shortest = (longest * (PERIODS_MIN - 1)).div_ceil(PERIODS_MIN);
    let mismatches: Vec<f64> = (shortest..=longest).map(mismatch).collect();
    let least = mismatches.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = mismatches.iter().copied().fold(0.0, f64::max);
    let accepted = least + MISMATCH_TOLERANCE * largest;
    // Pixels beyond the shortest length. The length of the least mismatch is always accepted, so the fallback is never
    // used.
    let mut extra = mismatches.iter().rposition(|m| *m <= accepted).unwrap_or(mismatches.len() - 1);
    // Descend to the next local minimum among shorter lengths: the whole number of periods near an accepted length.
    while extra > 0 && mismatches[extra - 1] < mismatches[extra] {
        extra -= 1;
    }
    shortest + extra
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn waves(nx: usize, ny: usize, period_x: f64, period_y: f64) -> HeightField {
        let height = |(iy, ix): (usize, usize)| {
            (TAU * ix as f64 / period_x).sin() + 0.5 * (TAU * iy as f64 / period_y + 0.3).cos()
        };
        HeightField::new(Array2::from_shape_fn((ny, nx), height), 0.1, 0.2).unwrap()
    }

    #[test]
    fn seams_tell_periodic_tiles_from_others() {
        let seams = waves(100, 60, 20.0, 12.0).seams();
        for seam in [seams.x.unwrap(), seams.y.unwrap()] {
            // The seam is one of the steps inside: at most √2 of their rms for a sinusoid.
            assert!(seam.ratio.unwrap() < 1.5, "{seam:?}");
        }
        let ratio = waves(110, 60, 20.0, 12.0).seams().x.unwrap().ratio.unwrap();
        assert!(ratio < 1.5, "half a period later a sine is at zero again: {ratio}");
        // Near a quarter of a period the sine is at its top: a step of 0.95, beside an rms of 0.22 inside.
        assert!(waves(105, 60, 20.0, 12.0).seams().x.unwrap().ratio.unwrap() > 3.0);
        let flat = HeightField::new(Array2::zeros((1, 5)), 1.0, 1.0).unwrap().seams();
        assert_eq!((flat.x.unwrap().ratio, flat.y), (None, None));
    }

    #[test]
    fn whole_periods_are_kept_unchanged() {
        let field = waves(130, 75, 20.0, 12.0);
        let (tile, report) = field.made_tileable(Some(1.0)).unwrap();
        // The strip leaves 120 of 130 pixels along x, six periods, and 70 of 75 along y, of which five periods are
        // kept.
        assert_eq!(tile.size(), (120, 60));
        assert!(report.rms_change_um < 1e-12 && report.blended_share < 0.2, "{report:?}");
        assert!((report.cut_um[0] - 1.0).abs() < 1e-12 && (report.cut_um[1] - 3.0).abs() < 1e-12, "{report:?}");
        assert!(report.seams_after.x.unwrap().ratio.unwrap() < 1.5);
    }

    #[test]
    fn edges_that_do_not_match_are_blended_and_the_rest_stays() {
        // A ramp of 3 µm, whose ends do not match, under random squares of 6 × 6 pixels and heights of 0 to 1 µm.
        let noise = |ix: usize, iy: usize| ((ix * 7919 + iy * 104_729 + ix * iy * 31) % 1009) as f64 / 1009.0;
        let slow = |ix: usize, iy: usize| 3.0 * (ix as f64 / 90.0) + noise(ix / 6, iy / 6);
        let field = HeightField::new(Array2::from_shape_fn((80, 90), |(y, x)| slow(x, y)), 0.1, 0.1).unwrap();
        let (tile, report) = field.made_tileable(None).unwrap();
        let (before, after) = (report.seams_before.x.unwrap(), report.seams_after.x.unwrap());
        assert!(before.ratio.unwrap() > 5.0 && after.ratio.unwrap() < 2.0, "{before:?} {after:?}");
        assert!(report.rms_change_um > 0.1, "{report:?}");
        let [strip_x, strip_y] = report.blend_um.map(|width| (width / 0.1).round() as usize);
        let rest = s![strip_y.., strip_x..];
        let (nx, ny) = tile.size();
        assert_eq!(tile.heights_um().slice(rest), field.heights_um().slice(s![..ny, ..nx]).slice(rest));
    }

    #[test]
    fn gratings_tile_along_x_and_bad_widths_are_refused() {
        let grating = HeightField::new(Array2::from_shape_fn((1, 50), |(_, x)| x as f64), 0.1, 7.0).unwrap();
        let (tile, report) = grating.made_tileable(None).unwrap();
        assert_eq!((tile.size().1, report.blend_um[1]), (1, 0.0));
        // 0.04 µm round to no pixel, 1.8 µm are more than a third of the 5 µm.
        for width in [0.0, 0.04, 1.8, -1.0, f64::NAN, f64::INFINITY] {
            let message = grating.made_tileable(Some(width)).unwrap_err().to_string();
            assert!(message.contains("along x") && message.contains("5 µm"), "{message}");
        }
        let pair = HeightField::new(Array2::zeros((1, 2)), 0.1, 0.1).unwrap();
        assert!(pair.made_tileable(None).is_err());
    }
}
