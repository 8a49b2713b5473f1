//! Detection of missing points that a program wrote as a number, such as −9999.
//!
//! Such a number is *isolated*: it is the lowest or the highest value of the file and lies far from all other values.
//! The criterion is the ratio gap/range. The *gap* is the distance from the number to the nearest other value. The
//! *range* is the highest minus the lowest of the other values.
//!
//! A *level* of a relief is a height that many points share exactly, such as the floor of a lamellar grating. A level
//! may lie as far from the other values as a number for missing points. It differs in two properties: it covers an
//! area, and the other values have a level, too. Measured heights have no levels: noise spreads them over many values.
//!
//! The numbers that programs commonly write for missing points, such as −9999, are never levels. The only exceptions
//! are both ends of the 16-bit integers, if a relief has both as levels, such as a grating from −32767 to 32767.

use ndarray::Array2;

/// Numbers that programs commonly write for missing points.
const MISSING_NUMBERS: [f64; 12] =
    [-999.0, -999.25, -999.9, -9999.0, -9999.9, -99999.0, -32768.0, -32767.0, 999.0, 9999.0, 99999.0, 32767.0];
/// The ends of the 16-bit integers, levels of a relief that is stored in full scale; a symmetric range begins at
/// −32767. All are in [`MISSING_NUMBERS`].
const FULL_SCALE: [f64; 3] = [-32768.0, -32767.0, 32767.0];
/// Smallest gap/range of a number in [`MISSING_NUMBERS`]. It is below 1, because reliefs are not always far from such a
/// number: heights of 0 to 2000 nm are only half a range above −999. A smaller bound would remove the extreme of a
/// relief that happens to be such a number.
const MISSING_GAP_MIN: f64 = 0.25;
/// Smallest gap/range of any other number. A smaller bound would remove particles of dust, which are usually less than
/// ten times as high as the relief. A larger one would leave missing points as spikes.
const GAP_MIN: f64 = 10.0;
/// Smallest fraction of all values that a level covers. A larger bound would remove narrow levels, such as thin ridges
/// of a grating. A smaller one would take missing points for a level, since they often are a few per cent.
const LEVEL_MIN: f64 = 0.05;
/// Fraction of the other values that is left out at either end, before their range is compared with the gap of one of
/// [`MISSING_NUMBERS`]. The ends may contain a second number for missing points, which would enlarge the range. It
/// often covers a few per cent, too. Larger ends would cut off more of the relief's own range.
const IGNORED_ENDS: f64 = LEVEL_MIN;
/// Smallest fraction of all values that the most frequent other number covers, if a number is to be a level beside it.
/// A quarter excludes coarsely quantised measurements, whose equal heights spread over more than four values.
const OTHER_LEVEL_MIN: f64 = 0.25;
/// Largest number of different numbers for missing points in one file. Three are common, for points not measured,
/// underflow and overflow; the fourth is spare.
const KINDS_MAX: usize = 4;

/// Numbers for missing points among the stored `values`, each with its count, in the order of their detection. NaN are
/// ignored, and do not count as values in this file.
///
/// The lowest or the highest number is isolated if its gap to the rest is at least [`GAP_MIN`] times the range of the
/// rest. For [`MISSING_NUMBERS`] the factor is [`MISSING_GAP_MIN`]. A level is not isolated.
pub(crate) fn isolated(values: &Array2<f64>) -> Vec<(f64, usize)> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let total = sorted.len();
    let mut rest = sorted.as_slice();
    let mut found = Vec::new();
    // Splits off one isolated number at a time.
    while found.len() < KINDS_MAX {
        let Some(split) = split_lowest(rest, total).or_else(|| split_highest(rest, total)) else { break };
        // If fewer than half of the values remain, the numbers split off are more probably levels of the relief.
        if 2 * split.rest.len() < total {
            return Vec::new();
        }
        found.push((split.value, split.count));
        rest = split.rest;
    }
    found
}

/// An isolated number, split off from sorted values.
struct Split<'a> {
    /// The isolated number.
    value: f64,
    /// Number of points with this number.
    count: usize,
    /// The other values, sorted.
    rest: &'a [f64],
}

/// Splits off the lowest number; `None` if it is not isolated. `sorted` has the values that are not split off yet;
/// `total` is the number of all values of the file.
fn split_lowest(sorted: &[f64], total: usize) -> Option<Split<'_>> {
    let value = *sorted.first()?;
    let (same, rest) = sorted.split_at(sorted.partition_point(|other| *other <= value));
    let gap = rest.first()? - value;
    let is_split = is_isolated(value, gap, rest) && !is_level(same, rest, total);
    is_split.then_some(Split { value, count: same.len(), rest })
}

/// Splits off the highest number; the counterpart of [`split_lowest`].
fn split_highest(sorted: &[f64], total: usize) -> Option<Split<'_>> {
    let value = *sorted.last()?;
    let (rest, same) = sorted.split_at(sorted.partition_point(|other| *other < value));
    let gap = value - rest.last()?;
    let is_split = is_isolated(value, gap, rest) && !is_level(same, rest, total);
    is_split.then_some(Split { value, count: same.len(), rest })
}

/// Whether `value` is isolated: `gap` is its distance from the `rest`, which is sorted and not empty.
fn is_isolated(value: f64, gap: f64, rest: &[f64]) -> bool {
    let range_of = |part: &[f64]| part.first().zip(part.last()).map_or(0.0, |(low, high)| high - low);
    let (range, gap_min) = if MISSING_NUMBERS.contains(&value) {
        let ignored = (IGNORED_ENDS * rest.len() as f64) as usize;
        (range_of(&rest[ignored..rest.len() - ignored]), MISSING_GAP_MIN)
    } else {
        (range_of(rest), GAP_MIN)
    };
    // With a range of 0 the rest is one level, and the number is the second level of the relief.
    range > 0.0 && gap >= gap_min * range
}

/// Whether the equal numbers `same` are a level of the relief beside another level in the `rest`, which is sorted.
/// `total` is the number of values of the file.
fn is_level(same: &[f64], rest: &[f64], total: usize) -> bool {
    // For a slice of equal numbers: its fraction of all values, and whether its number is in a list.
    let fraction = |equal: &[f64]| equal.len() as f64 / total as f64;
    let is_in = |equal: &[f64], numbers: &[f64]| equal.first().is_some_and(|value| numbers.contains(value));
    // Each of the other values, as a slice of equal numbers.
    let others = || rest.chunk_by(|a, b| a == b);
    let largest_other = others().map(fraction).fold(0.0, f64::max);
    let is_full_scale_level = |equal: &[f64]| is_in(equal, &FULL_SCALE) && fraction(equal) >= LEVEL_MIN;
    // One of `MISSING_NUMBERS` may be a level only if it is one end of full scale, and another end is a level, too. Any
    // other number may be a level.
    let may_be_level =
        !is_in(same, &MISSING_NUMBERS) || (is_in(same, &FULL_SCALE) && others().any(is_full_scale_level));
    may_be_level && fraction(same) >= LEVEL_MIN && largest_other >= OTHER_LEVEL_MIN
}

#[cfg(test)]
mod tests {
    use super::*;

    fn relief(height: f64) -> Array2<f64> {
        Array2::from_shape_fn((20, 30), |(iy, ix)| height * ((ix as f64 * 0.7).sin() + (iy as f64 * 0.9).cos()))
    }

    #[test]
    fn numbers_far_outside_the_relief_are_isolated() {
        // 5.5 lies more than ten ranges above a relief of ±0.2; −999 lies 0.8 ranges, more than a quarter, below one of
        // ±400.
        for (height, value) in [(0.1, -999.0), (200.0, -999.0), (0.1, 5.5), (0.1, -32768.0), (40.0, 32767.0)] {
            let mut values = relief(height);
            values[[3, 4]] = value;
            values[[9, 20]] = value;
            assert_eq!(isolated(&values), [(value, 2)], "{height}");
        }
        let mut two = relief(0.1);
        two[[0, 0]] = -9999.0;
        two[[5, 5]] = 9999.0;
        assert_eq!(isolated(&two), [(-9999.0, 1), (9999.0, 1)]);
    }

    #[test]
    fn numbers_that_cover_an_area_of_a_measured_relief_are_isolated() {
        for value in [-9999.0, 77.0] {
            let mut values = relief(0.1);
            values.slice_mut(ndarray::s![..8, ..]).fill(value);
            assert_eq!(isolated(&values), [(value, 240)]);
        }
        // Heights of a scan in whole steps of its converter, with 9 values.
        let mut coarse = relief(2.0).mapv(f64::round);
        coarse.slice_mut(ndarray::s![..3, ..]).fill(300.0);
        assert_eq!(isolated(&coarse), [(300.0, 90)]);
    }

    #[test]
    fn levels_spikes_and_flat_fields_are_reliefs() {
        assert!(isolated(&relief(0.1)).is_empty());
        assert!(isolated(&Array2::from_elem((4, 5), 0.0)).is_empty());
        // Two exact levels: a lamellar grating.
        let lamellar = Array2::from_shape_fn((4, 20), |(_, ix)| if ix % 10 == 0 { 0.5 } else { 0.0 });
        assert!(isolated(&lamellar).is_empty());
        // Levels with a few heights at the walls, which a tip rounds: either level is far from the rest.
        for (floor, top) in [(0.0, 0.125), (0.125, 0.0), (3.0, -7.0)] {
            let rounded = |ix: usize| if ix % 20 == 10 { top + 0.02 * (floor - top) } else { top };
            let walls = Array2::from_shape_fn((4, 40), |(_, ix)| if ix % 20 < 9 { floor } else { rounded(ix) });
            assert!(isolated(&walls).is_empty(), "{floor} {top}");
            // A number for missing points is found on such a grating, too.
            for value in [-9999.0, 1e4] {
                let mut values = walls.clone();
                values[[2, 3]] = value;
                assert_eq!(isolated(&values), [(value, 1)]);
            }
        }
        // A grating over the whole range of 16-bit integers: a quarter floor, a quarter walls, half top. The walls
        // begin at the top and end a quarter of the way to the floor. So the floor alone is far from the other values.
        let heights = |floor: f64, top: f64| {
            let wall = move |step: usize| (top + (floor - top) * 0.01 * (step * step) as f64).round();
            move |(_, ix): (usize, usize)| match ix % 20 {
                0..5 => floor,
                place @ 5..10 => wall(place - 4),
                _ => top,
            }
        };
        for (floor, top) in [(-32767.0, 32767.0), (-32768.0, 32767.0), (32767.0, -32767.0)] {
            assert!(isolated(&Array2::from_shape_fn((4, 40), heights(floor, top))).is_empty(), "{floor} {top}");
        }
        // Full scale at one end only may mark missing points of a grating.
        let mut saturated = Array2::from_shape_fn((4, 40), heights(0.0, 120.0));
        saturated.slice_mut(ndarray::s![.., ..4]).fill(32767.0);
        assert_eq!(isolated(&saturated), [(32767.0, 16)]);
        // Three exact levels.
        let levels = Array2::from_shape_fn((4, 30), |(_, ix)| [0.0, 1.0, 1.05][ix / 10]);
        assert!(isolated(&levels).is_empty());
        // Dust: five ranges high, with values in between.
        let mut dust = relief(0.1);
        for (ix, height) in [(4, 0.9), (5, 2.0), (6, 1.0)] {
            dust[[7, ix]] = height;
        }
        assert!(isolated(&dust).is_empty());
        // A few pillars on a smooth ground.
        let mut pillars = relief(0.001);
        for (ix, height) in [(4, 0.25), (9, 0.27), (15, 0.3)] {
            pillars[[7, ix]] = height;
        }
        assert!(isolated(&pillars).is_empty());
        // A level of more than half of the points.
        let mostly = Array2::from_shape_fn((10, 10), |(iy, ix)| if iy < 6 { -999.0 } else { 0.01 * ix as f64 });
        assert!(isolated(&mostly).is_empty());
    }
}
