//! Time per colour on one core.
//!
//! A colour is one evaluation of `f_r` in linear sRGB for one pair of directions (wi, wo). A candidate is a method with
//! one set of parameters (candidate.rs). In a repetition every candidate is timed once, in turn. The first candidate is
//! the baseline of the ratios: `flss` with the library's defaults.

use super::Effort;
use super::candidate::Candidate;
use crate::benchmarks::DirectionPair;
use cpu_time::ThreadTime;
use serde::Serialize;
use std::hint::black_box;

/// Smallest number of direction pairs of a timing. Chosen: the cost of a colour depends on the directions, and the mean
/// over fewer pairs depends on the choice of pairs.
const PAIRS_MIN: usize = 64;
/// Smallest duration of a timing as a fraction of [`Effort::repetition_ms`]. Chosen: milliseconds, long compared with
/// the resolution of the clock.
const TIMED_FRACTION: f64 = 0.2;

/// Time per colour, over the repetitions of one run.
///
/// The clock is the thread's CPU time on the CPU, the device's timestamps on a GPU, and the wall clock on a software
/// adapter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Timing {
    /// Median in µs.
    pub(crate) microseconds: f64,
    /// Shortest in µs.
    pub(crate) least_us: f64,
    /// Longest in µs.
    pub(crate) most_us: f64,
    /// Median ratio to the baseline's time in the same repetition.
    pub(crate) ratio: f64,
}

impl Timing {
    /// Statistics of a candidate's `times` in µs, one per repetition. `baseline` holds the baseline's times in the same
    /// repetitions.
    pub(super) fn new(times: &[f64], baseline: &[f64]) -> Self {
        let ratios = times.iter().zip(baseline).map(|(time, baseline)| time / baseline).collect();
        Self {
            microseconds: median(times.to_vec()),
            least_us: times.iter().copied().fold(f64::INFINITY, f64::min),
            most_us: times.iter().copied().fold(0.0, f64::max),
            ratio: median(ratios),
        }
    }
}

/// The median; of an even number of values, the upper of the two middle ones.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Timings of all candidates on one core.
///
/// Candidates that do the same work ([`Candidate::costs_like`]) pool their times. The address of an allocation alone
/// makes their times differ by more than `FRONT_MARGIN` of front.rs, within which two candidates count as equally fast.
pub(super) fn on_cpu(candidates: &[Candidate], pairs: &[DirectionPair], effort: &Effort) -> Vec<Timing> {
    let counts: Vec<usize> = candidates.iter().map(|candidate| pairs_per_pass(candidate, pairs, effort)).collect();
    let repetitions: Vec<Vec<f64>> = (0..effort.repetitions)
        .map(|_| {
            let time = |(candidate, count): (&Candidate, &usize)| microseconds(candidate, &pairs[..*count], effort);
            candidates.iter().zip(&counts).map(time).collect()
        })
        .collect();
    let timing = |candidate: &Candidate| {
        let alike: Vec<usize> = (0..candidates.len()).filter(|i| candidates[*i].costs_like(candidate)).collect();
        let with_baseline = alike.iter().flat_map(|&i| repetitions.iter().map(move |times| (times[i], times[0])));
        let (times, baseline): (Vec<f64>, Vec<f64>) = with_baseline.unzip();
        Timing::new(&times, &baseline)
    };
    candidates.iter().map(timing).collect()
}

/// Number of pairs whose evaluation lasts [`Effort::repetition_ms`], estimated from the fastest of three runs over
/// [`PAIRS_MIN`] pairs.
fn pairs_per_pass(candidate: &Candidate, pairs: &[DirectionPair], effort: &Effort) -> usize {
    let pass = || seconds(candidate, &pairs[..PAIRS_MIN]);
    let fastest = [pass(), pass(), pass()].into_iter().fold(f64::INFINITY, f64::min);
    let count = effort.repetition_ms * 1e-3 * PAIRS_MIN as f64 / fastest;
    (count as usize).clamp(PAIRS_MIN, pairs.len())
}

/// Time per colour in µs, the mean over whole passes through `pairs`.
fn microseconds(candidate: &Candidate, pairs: &[DirectionPair], effort: &Effort) -> f64 {
    // An untimed pass fills the processor's caches, which hold the data of the previous candidate.
    seconds(candidate, pairs);
    let (mut spent, mut passes) = (0.0, 0);
    while passes == 0 || spent < TIMED_FRACTION * 1e-3 * effort.repetition_ms {
        spent += seconds(candidate, pairs);
        passes += 1;
    }
    1e6 * spent / (passes * pairs.len()) as f64
}

/// CPU time of this thread in seconds for one colour of each pair. Other processes hardly change it.
fn seconds(candidate: &Candidate, pairs: &[DirectionPair]) -> f64 {
    let start = ThreadTime::now();
    for pair in pairs {
        // The obliquity and shadowing factor O·M (docs/model.md#the-reflectance) is 1 here, since every colour method
        // has the same one. Spectral tables compute their own.
        black_box(candidate.rgb(black_box(pair), 1.0));
    }
    start.elapsed().as_secs_f64().max(1e-9)
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
