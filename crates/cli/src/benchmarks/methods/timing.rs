use super::Effort;
use super::candidates::Candidate;
use crate::benchmarks::DirectionPair;
use cpu_time::ThreadTime;
use serde::Serialize;
use std::hint::black_box;

/// Fewest directions of a timing: fewer are not like the rest.
const DIRECTIONS_MIN: usize = 64;

/// Time per colour, over the repetitions of one run: a core's own time on the CPU; on a GPU that of its clock, on a software
/// adapter the wall clock's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Timing {
    /// Median in µs.
    pub microseconds: f64,
    pub least_us: f64,
    pub most_us: f64,
    /// Median of the ratio to the first candidate (`flss` with the library's defaults) in the same repetition.
    pub ratio: f64,
}

impl Timing {
    /// Of times in µs and those of the first candidate beside each.
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

/// Times on one core, the candidates in turn within each repetition. Those that cost the same work share all of their times:
/// where an allocation happens to lie tells them apart by more than the fronts' margin.
pub(super) fn on_cpu(candidates: &[Candidate], pairs: &[DirectionPair], effort: &Effort) -> Vec<Timing> {
    let counts: Vec<usize> = candidates
        .iter()
        .map(|candidate| {
            let pass = || seconds(candidate, &pairs[..DIRECTIONS_MIN]);
            let warm = [pass(), pass(), pass()].into_iter().fold(f64::INFINITY, f64::min);
            ((effort.repetition_ms * 1e-3 * DIRECTIONS_MIN as f64 / warm) as usize).clamp(DIRECTIONS_MIN, pairs.len())
        })
        .collect();
    let repetitions: Vec<Vec<f64>> = (0..effort.repetitions)
        .map(|_| {
            let time = |(candidate, count): (&Candidate, &usize)| {
                // The others have had the caches meanwhile, and some share their data.
                seconds(candidate, &pairs[..*count]);
                // Whole passes over the same directions until the clock's steps do not matter.
                let (mut spent, mut passes) = (0.0, 0);
                while passes == 0 || spent < 0.2e-3 * effort.repetition_ms {
                    spent += seconds(candidate, &pairs[..*count]);
                    passes += 1;
                }
                1e6 * spent / (passes * count) as f64
            };
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

/// Seconds of this thread's own time, to which what else the machine runs adds little.
fn seconds(candidate: &Candidate, pairs: &[DirectionPair]) -> f64 {
    let start = ThreadTime::now();
    for pair in pairs {
        // The angular factor is everyone's and not timed; the spectral tables compute it themselves.
        black_box(candidate.rgb(black_box(pair), 1.0));
    }
    start.elapsed().as_secs_f64().max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_ratios_are_of_repetitions() {
        let timing = Timing::new(&[2.0, 6.0, 3.0], &[1.0, 2.0, 3.0]);
        assert_eq!((timing.microseconds, timing.least_us, timing.most_us, timing.ratio), (3.0, 2.0, 6.0, 2.0));
    }
}
