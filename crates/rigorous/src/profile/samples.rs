//! The geometry of a profile from sampled heights: detection of corners, edges between them, Fourier series.
//!
//! Sample i of n covers x from i to i + 1 in units of period/n; its height is that of the centre, i + ½. The *angle* of
//! the step between two neighbouring samples is atan(Δz/Δx). The *turn* at a sample is the angle of the step to its
//! right minus that of the step to its left. A *wall* is a vertical step between two samples, a *kink* is a change of
//! slope at a sample, and *corner* means both.

use super::{CORNERS_MAX, EDGE_MIN, Edge, Shape};
use crate::Error;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Fewest heights that describe a curve. Fewer do not distinguish bends from corners.
const SAMPLES_MIN: usize = 8;
/// Smallest turn at a kink and on either side of a wall, in radians (20°). Smaller turns are noise.
const TURN_MIN: f64 = 0.35;
/// Smallest ratio of the turn at a kink to the turns two samples before and after. A bend that the sampling resolves
/// stays below this ratio.
const KINK_SHARPNESS_MIN: f64 = 4.0;
/// Smallest angle of a wall's step, in radians (60°). Less steep steps are flanks.
const WALL_ANGLE_MIN: f64 = 1.047;
/// Largest deviation of samples from a straight edge, as a fraction of the relief's height. On a relief five
/// wavelengths high it shifts a reflected wavefront by a hundredth of a wavelength.
const STRAIGHT_DEVIATION_MAX: f64 = 1e-3;
/// Largest sum of the magnitudes of the harmonics left out, as a fraction of the largest harmonic. Leaving them out
/// changes the relief by at most about a ten-thousandth of its height.
const TRUNCATION_MAX: f64 = 1e-4;
/// Fewest samples of a spline, the number of coefficients of a cubic. A piece of fewer samples becomes a straight edge.
const SPLINE_SAMPLES_MIN: usize = 4;

/// A corner found among the samples.
#[derive(Clone, Copy, PartialEq)]
enum Corner {
    /// A vertical wall between samples i − 1 and i.
    Wall(usize),
    /// A change of slope at sample i.
    Kink(usize),
}

impl Corner {
    /// Position along x in units of the distance between samples, where sample i is centred at i + ½.
    fn position(self) -> f64 {
        match self {
            Self::Wall(i) => i as f64,
            Self::Kink(i) => i as f64 + 0.5,
        }
    }

    /// First sample of the edge that begins at this corner.
    fn first_sample(self) -> usize {
        match self {
            Self::Wall(i) | Self::Kink(i) => i,
        }
    }

    /// Last sample of the edge that ends at this corner. The edge that ends at the first corner ends in the next period
    /// ([`Corner::in_next_period`]), so i ≥ 1.
    fn last_sample(self) -> usize {
        match self {
            Self::Wall(i) => i - 1,
            Self::Kink(i) => i,
        }
    }

    /// The corner one period of n samples later.
    fn in_next_period(self, n: usize) -> Self {
        match self {
            Self::Wall(i) => Self::Wall(i + n),
            Self::Kink(i) => Self::Kink(i + n),
        }
    }
}

/// The shape through `heights` (µm) at the centres of equal intervals of `period` (µm).
///
/// # Errors
/// Fewer than 8 heights, or more than 64 corners.
pub(super) fn shape(period: f64, heights: &[f64]) -> Result<Shape, Error> {
    let n = heights.len();
    if n < SAMPLES_MIN {
        return Err(Error::Profile { found: format!("{n} heights"), accepted: "at least 8 heights over one period" });
    }
    let corners = find_corners(period / n as f64, heights);
    if corners.is_empty() {
        return Ok(Shape::Smooth(fourier_coefficients(heights)));
    }
    if corners.len() > CORNERS_MAX {
        return Err(Error::Profile {
            found: format!("{} corners, as noise has", corners.len()),
            accepted: "at most 64 corners; smooth the heights, or use the scalar theory",
        });
    }
    Ok(Shape::Edges(edges_between(period, heights, &corners)))
}

/// The corners in order of x. `step` is the distance between samples in µm.
fn find_corners(step: f64, heights: &[f64]) -> Vec<Corner> {
    let n = heights.len();
    // The angle of the step from sample i − 1 to sample i. Indices may exceed n, since the heights repeat.
    let angle = |i: usize| (heights[i % n] - heights[(i + n - 1) % n]).atan2(step);
    let turn = |i: usize| angle(i + 1) - angle(i);
    // Whether a wall, a steep step with a turn at both samples, lies between samples i − 1 and i. `i + n − 1` is sample
    // i − 1, without a negative index.
    let is_wall =
        |i: usize| angle(i).abs() > WALL_ANGLE_MIN && turn(i + n - 1).abs() > TURN_MIN && turn(i).abs() > TURN_MIN;
    // Whether sample i is a kink. A sample on either side of a wall is none: its turn is due to the wall.
    let is_kink = |i: usize| {
        let around = turn(i + n - 2).abs().max(turn(i + 2).abs());
        turn(i).abs() > TURN_MIN.max(KINK_SHARPNESS_MIN * around) && !is_wall(i) && !is_wall(i + 1)
    };
    (0..n)
        .flat_map(|i| {
            let wall = is_wall(i).then_some(Corner::Wall(i));
            wall.into_iter().chain(is_kink(i).then_some(Corner::Kink(i)))
        })
        .collect()
}

/// Edges between consecutive corners, and vertical walls where the ends of neighbouring edges differ in height.
///
/// Each edge is fitted to its *piece*, the samples from its first corner to the next. The edge's ends are
/// extrapolated to the corners. The last edge ends at the first corner of the next period. Differences in
/// height up to [`EDGE_MIN`] periods, the shortest edge, are no walls.
fn edges_between(period: f64, heights: &[f64], corners: &[Corner]) -> Vec<Edge> {
    let n = heights.len();
    let step = period / n as f64;
    let (low, high) = heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &z| (lo.min(z), hi.max(z)));
    let tolerance = STRAIGHT_DEVIATION_MAX * (high - low);
    let mut edges: Vec<Edge> = Vec::new();
    for (c, &corner) in corners.iter().enumerate() {
        let next = corners.get(c + 1).copied().unwrap_or(corners[0].in_next_period(n));
        let (x0, x1) = (corner.position() * step, next.position() * step);
        let first = corner.first_sample();
        let piece: Vec<f64> = (first..=next.last_sample()).map(|i| heights[i % n]).collect();
        let height_at = |x: f64| extrapolated(&piece, x / step - first as f64 - 0.5);
        let (z0, z1) = (height_at(x0), height_at(x1));
        // Largest deviation of the piece from the straight line between both ends.
        let deviation = piece.iter().enumerate().fold(0.0_f64, |worst, (i, z)| {
            let x = (first as f64 + i as f64 + 0.5) * step;
            worst.max((z - z0 - (z1 - z0) * (x - x0) / (x1 - x0)).abs())
        });
        if let Some(before) = edges.last() {
            let end = before.ends()[1];
            if (end[1] - z0).abs() > EDGE_MIN * period {
                edges.push(Edge::line(end, [x0, z0]));
            }
        }
        edges.push(if deviation <= tolerance || piece.len() < SPLINE_SAMPLES_MIN {
            Edge::line([x0, z0], [x1, z1])
        } else {
            Edge::spline(x0, x1, &resampled(&piece, x0 / step - first as f64, x1 / step - first as f64))
        });
    }
    // The wall between the last edge and the first edge of the next period.
    if let (Some(last), Some(first)) = (edges.last(), edges.first()) {
        let (end, begin) = (last.ends()[1], first.ends()[0]);
        if (end[1] - begin[1]).abs() > EDGE_MIN * period {
            edges.push(Edge::line(end, [begin[0] + period, begin[1]]));
        }
    }
    edges
}

/// Linear interpolation of `piece`, extrapolated beyond its ends. `position` is counted in samples from the centre of
/// the first one.
fn extrapolated(piece: &[f64], position: f64) -> f64 {
    let last = piece.len() - 1;
    if last == 0 {
        return piece[0];
    }
    let i = (position.floor().max(0.0) as usize).min(last - 1);
    piece[i] + (piece[i + 1] - piece[i]) * (position - i as f64)
}

/// `piece` resampled at the centres of n equal intervals between the corners `from` and `to`, as [`Edge::spline`] needs
/// it; n is the length of `piece`. Positions are in samples; sample i covers i to i + 1.
fn resampled(piece: &[f64], from: f64, to: f64) -> Vec<f64> {
    let n = piece.len();
    (0..n).map(|i| extrapolated(piece, from + (to - from) * (i as f64 + 0.5) / n as f64 - 0.5)).collect()
}

/// Coefficients of [`Shape::Smooth`] in µm from heights (µm) at (i + ½)/n of the period. Harmonics at or above half the
/// sampling rate are left out, then the highest harmonics as far as [`TRUNCATION_MAX`] allows.
fn fourier_coefficients(heights: &[f64]) -> Vec<Complex64> {
    let n = heights.len();
    let half = n.div_ceil(2);
    let mut series: Vec<Complex64> = (0..half)
        .map(|m| {
            let sum: Complex64 = heights
                .iter()
                .enumerate()
                // The phase 2πm(i + ½)/n, reduced modulo 2π in integers.
                .map(|(i, z)| z * Complex64::cis(-TAU * ((m * (2 * i + 1)) % (2 * n)) as f64 / (2 * n) as f64))
                .sum();
            // The real part of harmonic m > 0 stands for both frequencies, m and −m.
            let factor = if m == 0 { 1.0 } else { 2.0 };
            sum * (factor / n as f64)
        })
        .collect();
    let largest = series[1..].iter().map(|c| c.norm()).fold(0.0, f64::max);
    // Sum of the magnitudes of the harmonics left out, the one under test included.
    let mut tail = 0.0;
    while series.len() > 1 {
        tail += series[series.len() - 1].norm();
        if tail > TRUNCATION_MAX * largest {
            break;
        }
        series.pop();
    }
    series
}

#[cfg(test)]
mod tests {
    use super::super::{Profile, smooth_height};
    use super::*;

    /// Bound on rounding, for heights of up to 1 µm.
    const ROUNDING_UM: f64 = 1e-12;

    /// The profile of n samples of a period of 2 µm; `height` is in µm over the fraction of the period.
    fn sampled(n: usize, height: impl Fn(f64) -> f64) -> Profile {
        let heights: Vec<f64> = (0..n).map(|i| height((i as f64 + 0.5) / n as f64)).collect();
        Profile::samples(2.0, &heights).unwrap()
    }

    /// Both ends of each edge; panics if an edge is not straight.
    fn straight_edges(profile: &Profile) -> Vec<[[f64; 2]; 2]> {
        let Shape::Edges(edges) = &profile.shape else { panic!("corners were expected") };
        assert!(edges.iter().all(Edge::is_straight));
        edges.iter().map(Edge::ends).collect()
    }

    #[test]
    fn sampled_presets_have_the_edges_of_the_presets() {
        for n in [64, 1024] {
            let edges = straight_edges(&sampled(n, |t| 0.5 * t));
            assert_eq!(edges.len(), 2, "a slope and a wall");
            for (found, expected) in edges.iter().flatten().flatten().zip([0.0, 0.0, 2.0, 0.5, 2.0, 0.5, 2.0, 0.0]) {
                assert!((found - expected).abs() < ROUNDING_UM, "{edges:?}");
            }
            let edges = straight_edges(&sampled(n, |t| if t < 0.5 { 0.3 } else { 0.0 }));
            assert_eq!(edges.len(), 4, "{edges:?}");
            assert!(edges.iter().flatten().any(|p| (p[0] - 1.0).abs() < ROUNDING_UM));
        }
    }

    #[test]
    fn apices_are_corners_and_resolved_bends_are_not() {
        let sinusoid = sampled(64, |t| 0.2 + 0.4 * (TAU * t).sin());
        let Shape::Smooth(harmonics) = &sinusoid.shape else { panic!("a sinusoid is smooth") };
        assert_eq!(harmonics.len(), 2);
        assert!((smooth_height(harmonics, 1.0)[0] - 0.2 - 0.4 * 1.0_f64.sin()).abs() < ROUNDING_UM);
        // An apex halfway between two samples is cut by half a sample: 0.5/257 in height, as the slope is 1. The factor
        // 1.5 is a margin.
        let triangle = sampled(257, |t| (t - 0.5).abs());
        assert!(triangle.has_corners());
        assert!((triangle.height_um() - 0.5).abs() < 0.5 / 257.0 * 1.5);
    }
}
