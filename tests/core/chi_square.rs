//! Pearson's χ² test of samples against a density over direction cosines.

use super::common::Random;
use rayon::prelude::*;
use sunbeam::scattering::Vec3;

/// Smallest accepted probability of the χ² found. Of 10⁴ tests of correct samplers one would fail by chance; seeds are
/// fixed.
pub(crate) const SIGNIFICANCE: f64 = 1e-4;
/// Number of samples in a histogram.
const SAMPLES: usize = 200_000;
/// Bins that reach beyond this radius are merged with the lost samples: at the horizon the density per area has a pole.
const RADIUS: f64 = 0.99;
/// Bins with fewer expected samples are merged.
const POOLED: f64 = 10.0;

/// Bins along one axis, with the density read at `places` points in each.
#[derive(Clone, Copy)]
pub(crate) struct Bins {
    pub count: usize,
    pub low: f64,
    pub width: f64,
    pub places: usize,
}

impl Bins {
    /// Larger distance of a bin's ends from zero.
    fn far(&self, bin: usize) -> f64 {
        (self.width * bin as f64 + self.low).abs().max((self.width * (bin + 1) as f64 + self.low).abs())
    }

    fn place(&self, bin: usize, place: usize) -> f64 {
        (bin as f64 + (place as f64 + 0.5) / self.places as f64) * self.width + self.low
    }
}

/// Probability of a χ² at least as large as found, if samples follow the density in 1/sr; and the fraction of lost
/// samples. `None` is a lost sample. Directions outside of all bins are counted with the lost ones.
///
/// # Panics
/// If the density integrates to more than one.
pub(crate) fn agreement(
    [x, y]: [Bins; 2],
    density: impl Fn(Vec3) -> f64 + Sync,
    mut sample: impl FnMut(&mut Random) -> Option<Vec3>,
) -> (f64, f64) {
    let count = x.count * y.count;
    let inside = |bin: usize| x.far(bin % x.count).hypot(y.far(bin / x.count)) < RADIUS;
    let mut expected: Vec<f64> = (0..count)
        .into_par_iter()
        .map(|bin| {
            if !inside(bin) {
                return 0.0;
            }
            let mut sum = 0.0;
            for place in 0..x.places * y.places {
                let [x, y] = [x.place(bin % x.count, place % x.places), y.place(bin / x.count, place / x.places)];
                let wo = [x, y, (1.0 - x * x - y * y).sqrt()];
                sum += density(wo) / wo[2];
            }
            sum * x.width * y.width / (x.places * y.places) as f64
        })
        .collect();
    expected.push(1.0 - expected.iter().sum::<f64>());
    assert!(expected[count] > -1e-3, "the density integrates to more than one: {}", expected[count]);
    let mut found = vec![0.0; count + 1];
    let (mut random, mut lost) = (Random::new(23), 0.0);
    for _ in 0..SAMPLES {
        let wo = sample(&mut random);
        lost += f64::from(u8::from(wo.is_none())) / SAMPLES as f64;
        let bin = wo.map_or(count, |wo| {
            let [i, j] = [(wo[0], x), (wo[1], y)].map(|(c, bins)| ((c - bins.low) / bins.width).floor());
            let there = [(i, x), (j, y)].iter().all(|(at, bins)| (0.0..bins.count as f64).contains(at));
            if there { j as usize * x.count + i as usize } else { count }
        });
        found[if bin < count && inside(bin) { bin } else { count }] += 1.0;
    }
    let (mut chi_square, mut freedom, mut few) = (0.0, -1.0, (0.0, 0.0));
    let mut add = |expected: f64, found: f64| {
        chi_square += (found - expected).powi(2) / expected;
        freedom += 1.0;
    };
    for (expected, found) in expected.iter().map(|p| p * SAMPLES as f64).zip(found) {
        if expected >= POOLED {
            add(expected, found);
        } else {
            few = (few.0 + expected, few.1 + found);
        }
    }
    if few.0 >= POOLED {
        add(few.0, few.1);
    }
    (tail(chi_square, f64::max(freedom, 1.0)), lost)
}

/// Upper tail of the χ² distribution (Wilson and Hilferty).
fn tail(chi_square: f64, freedom: f64) -> f64 {
    let z = ((chi_square / freedom).cbrt() - (1.0 - 2.0 / (9.0 * freedom))) / (2.0 / (9.0 * freedom)).sqrt();
    0.5 * libm::erfc(z / 2f64.sqrt())
}
