//! How far a relief is from tiling, and making it tile.

use super::{HeightField, HeightFieldError};
use ndarray::{Array2, Axis, s};
use serde::Serialize;
use std::f64::consts::PI;

/// Share of each axis that is blended where no width is given.
const BLEND_SHARE: f64 = 0.1;
/// Least share of an axis, less its blend, that may be kept for the sake of edges that match.
const KEPT_SHARE: f64 = 2.0 / 3.0;
/// Edges match well enough when they differ more than at the best length by no more than this share of what they differ by
/// at the worst: the longest such tile is kept.
const AS_GOOD: f64 = 0.1;

/// The step across the seam of a tile that repeats, along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Seam {
    /// Root mean square of the difference between the first pixel and the last, over all lines along the axis, in µm.
    pub seam_rms_um: f64,
    /// Root mean square of the difference between neighbours within the field along the axis, in µm.
    pub inside_rms_um: f64,
    /// The former over the latter: about 1 for a tile that repeats without a visible seam; `None` where neighbours do not
    /// differ at all.
    pub ratio: Option<f64>,
}

/// The seams across x and across y; `None` along an axis of one pixel, which repeats as it is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Seams {
    /// Where the right edge meets the left one.
    pub x: Option<Seam>,
    /// Where the upper edge meets the lower one.
    pub y: Option<Seam>,
}

/// What making a field tile did to it. Pairs are along x and y.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TileReport {
    /// Length that was cut off, the blended strip included, in µm.
    pub cut_um: [f64; 2],
    /// Width over which the edges were blended, in µm; 0 along an axis of one pixel.
    pub blend_um: [f64; 2],
    /// Share of the tile's pixels that were blended.
    pub blended_share: f64,
    /// Root mean square change of those pixels, in µm.
    pub rms_change_um: f64,
    /// Root mean square height before (over the part that is kept) and after, in µm: blending what does not match lowers it.
    pub rms_um: [f64; 2],
    /// The steps across the edges of the rectangle as it was cut out.
    pub seams_before: Seams,
    /// The same once its edges were blended.
    pub seams_after: Seams,
}

impl HeightField {
    /// The steps across the seams that the field would have if it repeated as it is. A tilt shows as a seam: level first.
    pub fn seams(&self) -> Seams {
        Seams { x: seam(&self.heights_um, Axis(1)), y: seam(&self.heights_um, Axis(0)) }
    }

    /// A tile of the same relief that repeats without a seam, and what that took.
    ///
    /// Along each axis (x first) the strip of `blend_um` beyond the tile's end is laid over the tile's beginning and faded out
    /// with a raised cosine, so that the end runs on into the beginning. The tile is as long as makes the two strips differ
    /// least (a whole number of periods where there are any), between two thirds and all of what the strip leaves; of lengths
    /// that match nearly as well, the longest. Without `blend_um` a tenth of each axis is blended. The rest of the
    /// heights stays as it is.
    ///
    /// # Errors
    /// [`HeightFieldError::Blend`] for a width below a pixel or above a third of the extent along an axis of several pixels.
    pub fn made_tileable(&self, blend_um: Option<f64>) -> Result<(Self, TileReport), HeightFieldError> {
        let (nx, ny) = self.size();
        let (extent_x, extent_y) = self.extent_um();
        let strip = |axis, count: usize, step_um: f64, extent_um: f64| {
            let width_um = blend_um.unwrap_or((BLEND_SHARE * extent_um).max(step_um));
            let pixels = (width_um / step_um).round();
            match count {
                1 => Ok(0),
                _ if pixels >= 1.0 && pixels <= count as f64 / 3.0 => Ok(pixels as usize),
                _ => Err(HeightFieldError::Blend { axis, width_um, extent_um }),
            }
        };
        let strip_x = strip("x", nx, self.dx_um, extent_x)?;
        let strip_y = strip("y", ny, self.dy_um, extent_y)?;
        // Along y as along x, turned over.
        let along_x = blended(&self.heights_um, strip_x);
        let heights = blended(&along_x.t().to_owned(), strip_y).t().as_standard_layout().into_owned();
        let tile = Self { heights_um: heights, dx_um: self.dx_um, dy_um: self.dy_um };

        let (kept_x, kept_y) = tile.size();
        let kept = Self { heights_um: self.heights_um.slice(s![..kept_y, ..kept_x]).to_owned(), ..tile.clone() };
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

fn seam(heights: &Array2<f64>, axis: Axis) -> Option<Seam> {
    let count = heights.len_of(axis);
    if count < 2 {
        return None;
    }
    let rms_between = |a: usize, b: usize| {
        let (a, b) = (heights.index_axis(axis, a), heights.index_axis(axis, b));
        a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / a.len() as f64
    };
    let inside = (1..count).map(|i| rms_between(i - 1, i)).sum::<f64>() / (count - 1) as f64;
    let (seam_rms_um, inside_rms_um) = (rms_between(count - 1, 0).sqrt(), inside.sqrt());
    Some(Seam { seam_rms_um, inside_rms_um, ratio: (inside_rms_um > 0.0).then(|| seam_rms_um / inside_rms_um) })
}

/// The tile along x whose strip of `strip` pixels is blended; as it is for a strip of none.
fn blended(heights: &Array2<f64>, strip: usize) -> Array2<f64> {
    let (ny, nx) = heights.dim();
    if strip == 0 {
        return heights.clone();
    }
    let mismatch = |length: usize| -> f64 {
        let (beginning, beyond) = (heights.slice(s![.., ..strip]), heights.slice(s![.., length..length + strip]));
        beginning.iter().zip(beyond).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    let longest = nx - strip;
    let shortest = ((KEPT_SHARE * longest as f64).ceil() as usize).clamp(strip, longest);
    let mismatches: Vec<f64> = (shortest..=longest).map(mismatch).collect();
    let least = mismatches.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = mismatches.iter().copied().fold(0.0, f64::max);
    let good = least + AS_GOOD * largest;
    let mut best = mismatches.iter().rposition(|m| *m <= good).unwrap_or(mismatches.len() - 1);
    // On to the best of its surroundings, which is the whole period that a good length is near to.
    while best > 0 && mismatches[best - 1] < mismatches[best] {
        best -= 1;
    }
    let length = shortest + best;
    Array2::from_shape_fn((ny, length), |(iy, ix)| {
        let own = heights[[iy, ix]];
        if ix >= strip {
            return own;
        }
        let weight = 0.5 - 0.5 * (PI * (ix as f64 + 0.5) / strip as f64).cos();
        weight * own + (1.0 - weight) * heights[[iy, length + ix]]
    })
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
    fn a_tile_that_repeats_has_no_seam_and_one_that_does_not_has() {
        let seams = waves(100, 60, 20.0, 12.0).seams();
        for seam in [seams.x.unwrap(), seams.y.unwrap()] {
            // The seam's step is one sample of the steps inside, at one phase: here √2 of their rms at most.
            assert!(seam.ratio.unwrap() < 1.5, "{seam:?}");
        }
        let ratio = waves(110, 60, 20.0, 12.0).seams().x.unwrap().ratio.unwrap();
        assert!(ratio < 1.5, "half a period later a sine is at zero again: {ratio}");
        assert!(waves(105, 60, 20.0, 12.0).seams().x.unwrap().ratio.unwrap() > 3.0);
        let flat = HeightField::new(Array2::zeros((1, 5)), 1.0, 1.0).unwrap().seams();
        assert_eq!((flat.x.unwrap().ratio, flat.y), (None, None));
    }

    #[test]
    fn whole_periods_are_kept_and_nothing_else_changes() {
        let field = waves(130, 75, 20.0, 12.0);
        let (tile, report) = field.made_tileable(Some(1.0)).unwrap();
        // 120 pixels are left of 130 along x, six periods; 70 along y, of which five periods.
        assert_eq!(tile.size(), (120, 60));
        assert!(report.rms_change_um < 1e-12 && report.blended_share < 0.2, "{report:?}");
        assert!((report.cut_um[0] - 1.0).abs() < 1e-12 && (report.cut_um[1] - 3.0).abs() < 1e-12, "{report:?}");
        assert!(report.seams_after.x.unwrap().ratio.unwrap() < 1.5);
    }

    #[test]
    fn what_does_not_match_is_blended_and_the_rest_left() {
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
    fn gratings_tile_along_x_alone_and_bad_widths_are_refused() {
        let grating = HeightField::new(Array2::from_shape_fn((1, 50), |(_, x)| x as f64), 0.1, 7.0).unwrap();
        let (tile, report) = grating.made_tileable(None).unwrap();
        assert_eq!((tile.size().1, report.blend_um[1]), (1, 0.0));
        for width in [0.0, 0.04, 1.8, -1.0, f64::NAN, f64::INFINITY] {
            let message = grating.made_tileable(Some(width)).unwrap_err().to_string();
            assert!(message.contains("along x") && message.contains("5 µm"), "{message}");
        }
        let pair = HeightField::new(Array2::zeros((1, 2)), 0.1, 0.1).unwrap();
        assert!(pair.made_tileable(None).is_err());
    }
}
