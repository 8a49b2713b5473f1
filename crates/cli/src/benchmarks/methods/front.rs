//! The Pareto front of time and errors: the points that no other point beats.

/// Relative difference below which two times or two errors count as equal. Repeated runs differ by about this.
const FRONT_MARGIN: f64 = 0.05;

/// ΔE₂₀₀₀ below which differences do not count on a front. A difference of 1 is just noticeable.
const DELTA_E_MIN: f64 = 0.05;

/// A ΔE₂₀₀₀ for comparison on a front: values below [`DELTA_E_MIN`] become equal, a NaN stays.
pub(crate) fn noticed(delta_e: f64) -> f64 {
    delta_e.clamp(DELTA_E_MIN, f64::INFINITY)
}

/// Whether each point `(time, errors)` lies on the front.
///
/// A rival beats a point if no error is larger and either it is faster, or it is no slower and one error is better.
/// "Faster" and "better" mean smaller by more than [`FRONT_MARGIN`]. A NaN counts as an infinite error.
pub(crate) fn front<const ERRORS: usize>(points: &[(f64, [f64; ERRORS])]) -> Vec<bool> {
    let nan_to_infinity = |error: f64| if error.is_nan() { f64::INFINITY } else { error };
    let points: Vec<_> = points.iter().map(|(time, errors)| (*time, errors.map(nan_to_infinity))).collect();
    let is_clearly_less = |a: f64, b: f64| a < (1.0 - FRONT_MARGIN) * b;
    let is_beaten = |(time, errors): &(f64, [f64; ERRORS])| {
        points.iter().any(|(rival_time, rival_errors)| {
            let error_pairs = || rival_errors.iter().zip(errors);
            let is_faster = is_clearly_less(*rival_time, *time);
            let is_better = error_pairs().any(|(rival, own)| is_clearly_less(*rival, *own));
            let is_no_worse = error_pairs().all(|(rival, own)| rival <= own);
            is_no_worse && (is_faster || is_better && rival_time <= time)
        })
    };
    points.iter().map(|point| !is_beaten(point)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_beaten_in_time_and_error_is_behind_the_front() {
        let points =
            [(1.0, 1.0), (2.0, 0.5), (2.0, 2.0), (1.01, 1.0), (9.0, f64::NAN), (1.5, 1.0), (4.0, 0.01), (8.0, 0.001)];
        let points = points.map(|(time, error)| (time, [noticed(error)]));
        assert_eq!(front(&points), [true, true, false, true, false, false, true, false]);
        assert_eq!(front(&[(1.0, [f64::NAN])]), [true]);
    }

    #[test]
    fn a_point_better_by_one_error_is_on_the_front() {
        let points = [(1.0, [2.0, 9.0]), (2.0, [1.9, 9.0]), (3.0, [2.0, 8.0]), (4.0, [1.9, 8.5]), (5.0, [1.9, 8.5])];
        assert_eq!(front(&points), [true, true, true, true, false]);
    }
}
