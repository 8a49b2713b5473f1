//! Time per colour on one core.
//!
//! A colour is one evaluation of `f_r` without its Fresnel factor, in linear sRGB, for one pair of directions (wi, wo).
//! A candidate is a method with one set of parameters (candidate.rs). In each repetition every candidate is timed once.
//! The first candidate, `flss` with the library's defaults, is the baseline of the ratios.

use super::Effort;
use super::candidate::Candidate;
use crate::benchmarks::DirectionPair;
use cpu_time::ThreadTime;
use serde::Serialize;
use std::hint::black_box;

/// Smallest number of direction pairs of a timing. The cost of a colour depends on the directions, so with fewer pairs
/// the mean would depend on their choice. With more, slow candidates would exceed [`Effort::repetition_ms`].
const PAIRS_MIN: usize = 64;
/// Smallest duration of a timing as a fraction of [`Effort::repetition_ms`]; shorter passes are repeated. In a full run
/// that is 5 ms, long compared with the resolution of the clock. Larger fractions take more time.
const TIMED_FRACTION: f64 = 0.2;
/// Lower limit of measured times in seconds, which are divisors: a coarse clock may not advance during a short run.
const TIME_MIN_S: f64 = 1e-9;

/// Statistics of the time per colour over the repetitions of a run.
///
/// The clock on the CPU is the thread's CPU time. On a GPU it is the device's timestamps, or the wall clock where the
/// adapter has none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Timing {
    /// Median in µs.
    pub(crate) microseconds: f64,
    /// Shortest in µs.
    pub(crate) least_us: f64,
    /// Longest in µs.
    pub(crate) most_us: f64,
    /// Median of the ratios to the baseline's time in the same repetition.
    pub(crate) ratio: f64,
}

impl Timing {
    /// Statistics of a candidate's times in µs, at least one. `baseline_us` holds the baseline's times in the same
    /// repetitions.
    pub(super) fn new(times_us: &[f64], baseline_us: &[f64]) -> Self {
        let ratios = times_us.iter().zip(baseline_us).map(|(time, baseline)| time / baseline).collect();
        Self {
            microseconds: median(times_us.to_vec()),
            least_us: times_us.iter().copied().fold(f64::INFINITY, f64::min),
            most_us: times_us.iter().copied().fold(0.0, f64::max),
            ratio: median(ratios),
        }
    }
}

/// The median of at least one value: of an even number of values, the upper of the two middle ones.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Timings of all candidates on one core, from at least one repetition.
///
/// Candidates that do the same work ([`Candidate::costs_like`]) pool their times. Otherwise the addresses of their
/// allocations alone would make their times differ by more than the 5 % that count as equal (`MARGIN` of pareto.rs).
pub(super) fn on_cpu(candidates: &[Candidate], pairs: &[DirectionPair], effort: &Effort) -> Vec<Timing> {
    let counts: Vec<usize> = candidates.iter().map(|candidate| pairs_per_pass(candidate, pairs, effort)).collect();
    // Times in µs, `[repetition][candidate]`.
    let repetitions_us: Vec<Vec<f64>> = (0..effort.repetitions)
        .map(|_| {
            let time =
                |(candidate, count): (&Candidate, &usize)| mean_microseconds(candidate, &pairs[..*count], effort);
            candidates.iter().zip(&counts).map(time).collect()
        })
        .collect();
    let timing = |candidate: &Candidate| {
        let alike: Vec<usize> = (0..candidates.len()).filter(|i| candidates[*i].costs_like(candidate)).collect();
        // Pairs of a time and the baseline's, that of candidate 0, in the same repetition.
        let with_baseline = alike.iter().flat_map(|&i| repetitions_us.iter().map(move |times| (times[i], times[0])));
        let (times_us, baseline_us): (Vec<f64>, Vec<f64>) = with_baseline.unzip();
        Timing::new(&times_us, &baseline_us)
    };
    candidates.iter().map(timing).collect()
}

/// Number of pairs whose evaluation lasts [`Effort::repetition_ms`], at least [`PAIRS_MIN`] and at most all. It is
/// estimated from the fastest of three runs over [`PAIRS_MIN`] pairs. `pairs` has these: both values of [`Effort`] give
/// at least 512.
fn pairs_per_pass(candidate: &Candidate, pairs: &[DirectionPair], effort: &Effort) -> usize {
    let pass = || seconds(candidate, &pairs[..PAIRS_MIN]);
    let fastest = [pass(), pass(), pass()].into_iter().fold(f64::INFINITY, f64::min);
    let count = effort.repetition_ms * 1e-3 * PAIRS_MIN as f64 / fastest;
    (count as usize).clamp(PAIRS_MIN, pairs.len())
}

/// Time per colour in µs: the mean over at least one pass through `pairs`, and as many as it takes to last
/// [`TIMED_FRACTION`] of [`Effort::repetition_ms`].
fn mean_microseconds(candidate: &Candidate, pairs: &[DirectionPair], effort: &Effort) -> f64 {
    // An untimed pass fills the processor's caches, which hold the data of the previous candidate.
    seconds(candidate, pairs);
    let (mut spent, mut passes) = (0.0, 0);
    while passes == 0 || spent < TIMED_FRACTION * 1e-3 * effort.repetition_ms {
        spent += seconds(candidate, pairs);
        passes += 1;
    }
    1e6 * spent / (passes * pairs.len()) as f64
}

/// CPU time in seconds of one pass, a colour of each pair. Unlike the wall clock, the CPU time of a thread hardly
/// depends on other processes.
fn seconds(candidate: &Candidate, pairs: &[DirectionPair]) -> f64 {
    let start = ThreadTime::now();
    for pair in pairs {
        // 1 stands for the obliquity and shadowing factor O·M (docs/model.md#the-reflectance). All colour methods are
        // multiplied by the same factor, so its time is left out. Spectral tables compute it themselves.
        black_box(candidate.rgb(black_box(pair), 1.0));
    }
    start.elapsed().as_secs_f64().max(TIME_MIN_S)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_taken_within_a_repetition() {
        let timing = Timing::new(&[2.0, 6.0, 3.0], &[1.0, 2.0, 3.0]);
        assert_eq!((timing.microseconds, timing.least_us, timing.most_us, timing.ratio), (3.0, 2.0, 6.0, 2.0));
    }
}
