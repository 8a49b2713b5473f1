//! Times of a colour on one core.

use super::Effort;
use super::candidate::Candidate;
use crate::benchmarks::DirectionPair;
use cpu_time::ThreadTime;
use serde::Serialize;
use std::hint::black_box;

/// Smallest number of directions of a timing: the mean over fewer depends on which ones they are.
const DIRECTIONS_MIN: usize = 64;
/// Fraction of [`Effort::repetition_ms`] that a timing lasts at least: long compared with the resolution of the clock.
const TIMED_FRACTION: f64 = 0.2;

/// Time per colour, over the repetitions of one run.
///
/// On the CPU it is a thread's own time; on a GPU that of its clock, on a software adapter that of the wall clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Timing {
    /// Median in µs.
    pub(crate) microseconds: f64,
    /// Shortest in µs.
    pub(crate) least_us: f64,
    /// Longest in µs.
    pub(crate) most_us: f64,
    /// Median ratio to the first candidate's time in the same repetition: `flss` with the library's defaults.
    pub(crate) ratio: f64,
}

impl Timing {
    /// The statistics of times in µs, one a repetition, and of the first candidate's times in the same repetitions.
    pub(super) fn new(times: &[f64], first: &[f64]) -> Self {
        let ratios = times.iter().zip(first).map(|(time, first)| time / first).collect();
        Self {
            microseconds: median(times.to_vec()),
            least_us: times.iter().copied().fold(f64::INFINITY, f64::min),
            most_us: times.iter().copied().fold(0.0, f64::max),
            ratio: median(ratios),
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Times on one core, the candidates in turn within each repetition.
///
/// Candidates that cost the same work share all of their times: the address of an allocation alone tells them apart by
/// more than the margin of the front.
pub(super) fn on_cpu(candidates: &[Candidate], pairs: &[DirectionPair], effort: &Effort) -> Vec<Timing> {
    let counts: Vec<usize> = candidates.iter().map(|candidate| directions_per_pass(candidate, pairs, effort)).collect();
    let repetitions: Vec<Vec<f64>> = (0..effort.repetitions)
        .map(|_| {
            let time = |(candidate, count): (&Candidate, &usize)| microseconds(candidate, &pairs[..*count], effort);
            candidates.iter().zip(&counts).map(time).collect()
        })
        .collect();
    let timing = |candidate: &Candidate| {
        let alike: Vec<usize> = (0..candidates.len()).filter(|i| candidates[*i].costs_like(candidate)).collect();
        let with_first = alike.iter().flat_map(|&i| repetitions.iter().map(move |times| (times[i], times[0])));
        let (times, first): (Vec<f64>, Vec<f64>) = with_first.unzip();
        Timing::new(&times, &first)
    };
    candidates.iter().map(timing).collect()
}

/// The number of directions that takes a repetition's time, by the fastest of three runs over the fewest.
fn directions_per_pass(candidate: &Candidate, pairs: &[DirectionPair], effort: &Effort) -> usize {
    let pass = || seconds(candidate, &pairs[..DIRECTIONS_MIN]);
    let fastest = [pass(), pass(), pass()].into_iter().fold(f64::INFINITY, f64::min);
    let count = effort.repetition_ms * 1e-3 * DIRECTIONS_MIN as f64 / fastest;
    (count as usize).clamp(DIRECTIONS_MIN, pairs.len())
}

/// Time per colour in µs, over whole passes through the directions.
fn microseconds(candidate: &Candidate, pairs: &[DirectionPair], effort: &Effort) -> f64 {
    // Fills the caches, which the other candidates have used meanwhile.
    seconds(candidate, pairs);
    let (mut spent, mut passes) = (0.0, 0);
    while passes == 0 || spent < TIMED_FRACTION * 1e-3 * effort.repetition_ms {
        spent += seconds(candidate, pairs);
        passes += 1;
    }
    1e6 * spent / (passes * pairs.len()) as f64
}

/// Seconds of this thread's own time, which the machine's other work hardly changes.
fn seconds(candidate: &Candidate, pairs: &[DirectionPair]) -> f64 {
    let start = ThreadTime::now();
    for pair in pairs {
        // The factor O·M costs every method the same and is not timed; the spectral tables include it.
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
