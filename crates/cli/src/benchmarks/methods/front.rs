/// Differences of less than this share of time or error do not put a point behind the front: repeated runs differ by as
/// much.
pub const FRONT_MARGIN: f64 = 0.05;

/// What a ΔE₂₀₀₀ counts as: those below a twentieth of what an eye just notices count alike.
pub fn noticed(delta_e: f64) -> f64 {
    delta_e.clamp(0.05, f64::INFINITY)
}

/// Which of the points `(time, errors)` no other beats: none is faster and as good by every measure of error, or better by
/// one, as good by the others and no slower. Errors that are not numbers are beaten by any.
pub fn front<const MEASURES: usize>(points: &[(f64, [f64; MEASURES])]) -> Vec<bool> {
    let heeded = |error: f64| if error.is_nan() { f64::INFINITY } else { error };
    let points: Vec<_> = points.iter().map(|(time, errors)| (*time, errors.map(heeded))).collect();
    let keep = 1.0 - FRONT_MARGIN;
    let beaten = |a: &(f64, [f64; MEASURES])| {
        points.iter().any(|b| {
            let errors = || b.1.iter().zip(&a.1);
            let (faster, better) = (b.0 < keep * a.0, errors().any(|(b, a)| *b < keep * a));
            let (no_slower, no_worse) = (b.0 <= a.0, errors().all(|(b, a)| b <= a));
            no_worse && (faster || better && no_slower)
        })
    };
    points.iter().map(|point| !beaten(point)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_beaten_in_both_is_behind() {
        let points =
            [(1.0, 1.0), (2.0, 0.5), (2.0, 2.0), (1.01, 1.0), (9.0, f64::NAN), (1.5, 1.0), (4.0, 0.01), (8.0, 0.001)];
        let points = points.map(|(time, error)| (time, [noticed(error)]));
        assert_eq!(front(&points), [true, true, false, true, false, false, true, false]);
        assert_eq!(front(&[(1.0, [f64::NAN])]), [true]);
    }

    #[test]
    fn being_better_by_one_measure_is_enough() {
        let points = [(1.0, [2.0, 9.0]), (2.0, [1.9, 9.0]), (3.0, [2.0, 8.0]), (4.0, [1.9, 8.5]), (5.0, [1.9, 8.5])];
        assert_eq!(front(&points), [true, true, true, true, false]);
    }
}
