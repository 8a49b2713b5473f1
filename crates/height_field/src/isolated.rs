//! Numbers that stand isolated from all heights: missing points that a program wrote as a number.

use ndarray::Array2;

/// Numbers that programs write for missing points. They lie outside the rest by a quarter of its range at least.
const MISSING_NUMBERS: [f64; 12] =
    [-999.0, -999.25, -999.9, -9999.0, -9999.9, -99999.0, -32768.0, -32767.0, 999.0, 9999.0, 99999.0, 32767.0];
/// Gap to the rest, in ranges of the rest, from which these are missing points: heights of hundreds of nm come near -999.
const KNOWN_GAP_MIN: f64 = 0.25;
/// Gap to the rest, in ranges of the rest, from which other numbers are missing points. A spike of dust is some ten ranges
/// high and has many values; a missing point has one.
const GAP_MIN: f64 = 10.0;
/// Share of the points that isolated numbers may make up. Beyond it they are a level of the relief.
const SHARE_MAX: f64 = 0.5;
/// Kinds of missing numbers that a file may have, such as under and over range.
const KINDS_MAX: usize = 4;

/// Numbers that stand for missing points among `values` as a file has them (NaN are left out), each with its count.
///
/// One number at either end of the values is isolated if the gap to the rest is [`GAP_MIN`] times the range of the rest, or
/// a quarter of it for the numbers that programs use. The relief must be more than two levels.
pub(crate) fn isolated(values: &Array2<f64>) -> Vec<(f64, usize)> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let total = sorted.len();
    let mut rest = sorted.as_slice();
    let mut found = Vec::new();
    while found.len() < KINDS_MAX {
        let Some((value, count, others)) = lowest(rest).or_else(|| highest(rest)) else { break };
        if (total - others.len()) as f64 > SHARE_MAX * total as f64 {
            return Vec::new();
        }
        found.push((value, count));
        rest = others;
    }
    found
}

type Split<'a> = Option<(f64, usize, &'a [f64])>;

/// The lowest number, its count and the rest, if it is isolated.
fn lowest(sorted: &[f64]) -> Split<'_> {
    let value = *sorted.first()?;
    let (same, rest) = sorted.split_at(sorted.partition_point(|other| *other <= value));
    is_isolated(value, rest.first()? - value, rest).then_some((value, same.len(), rest))
}

/// The highest number, its count and the rest, if it is isolated.
fn highest(sorted: &[f64]) -> Split<'_> {
    let value = *sorted.last()?;
    let (rest, same) = sorted.split_at(sorted.partition_point(|other| *other < value));
    is_isolated(value, value - rest.last()?, rest).then_some((value, same.len(), rest))
}

fn is_isolated(value: f64, gap: f64, rest: &[f64]) -> bool {
    let range = |part: &[f64]| part.first().zip(part.last()).map_or(0.0, |(low, high)| high - low);
    let (range, gap_min) = if MISSING_NUMBERS.contains(&value) {
        // A second missing number in the rest would hide the relief's own range. All but a twentieth at either end have it.
        (range(&rest[rest.len() / 20..rest.len() - rest.len() / 20]), KNOWN_GAP_MIN)
    } else {
        (range(rest), GAP_MIN)
    };
    range > 0.0 && gap >= gap_min * range
}

#[cfg(test)]
mod tests {
    use super::*;

    fn relief(height: f64) -> Array2<f64> {
        Array2::from_shape_fn((20, 30), |(iy, ix)| height * ((ix as f64 * 0.7).sin() + (iy as f64 * 0.9).cos()))
    }

    #[test]
    fn numbers_far_outside_the_relief_are_isolated() {
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
    fn levels_spikes_and_flat_fields_are_reliefs() {
        assert!(isolated(&relief(0.1)).is_empty());
        assert!(isolated(&Array2::from_elem((4, 5), 0.0)).is_empty());
        // Two exact levels: a lamellar grating.
        let lamellar = Array2::from_shape_fn((4, 20), |(_, ix)| if ix % 10 == 0 { 0.5 } else { 0.0 });
        assert!(isolated(&lamellar).is_empty());
        // Dust, five ranges high and with a slope of its own.
        let mut dust = relief(0.1);
        for (ix, height) in [(4, 0.9), (5, 2.0), (6, 1.0)] {
            dust[[7, ix]] = height;
        }
        assert!(isolated(&dust).is_empty());
        // Few pillars on a smooth ground.
        let mut pillars = relief(0.001);
        for (ix, height) in [(4, 0.25), (9, 0.27), (15, 0.3)] {
            pillars[[7, ix]] = height;
        }
        assert!(isolated(&pillars).is_empty());
        // More than half of the points are a level, not missing.
        let mostly = Array2::from_shape_fn((10, 10), |(iy, ix)| if iy < 6 { -999.0 } else { 0.01 * ix as f64 });
        assert!(isolated(&mostly).is_empty());
    }
}
