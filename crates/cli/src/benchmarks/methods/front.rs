//! The Pareto front of time and errors: the points that no other point beats.

/// Relative difference of time or error below which two points count as equal; repeated runs differ by as much.
const FRONT_MARGIN: f64 = 0.05;

/// Smallest ΔE₂₀₀₀ that counts on a front: a twentieth of a just noticeable difference, 1.
const DELTA_E_MIN: f64 = 0.05;

/// A ΔE₂₀₀₀ as it counts on a front: values below [`DELTA_E_MIN`] count as equal.
pub(crate) fn noticed(delta_e: f64) -> f64 {
    delta_e.clamp(DELTA_E_MIN, f64::INFINITY)
}

/// Whether each point `(time, errors)` lies on the front.
///
/// Another point beats a point if it is no worse by any error, and is either faster, or better by one error and no
/// slower. "Faster" and "better" mean by more than [`FRONT_MARGIN`]. A NaN counts as an infinite error.
pub(crate) fn front<const ERRORS: usize>(points: &[(f64, [f64; ERRORS])]) -> Vec<bool> {
    let finite_or_infinite = |error: f64| if error.is_nan() { f64::INFINITY } else { error };
    let points: Vec<_> = points.iter().map(|(time, errors)| (*time, errors.map(finite_or_infinite))).collect();
    // `b` must be below this factor times `a` to count as faster or better.
    let keep = 1.0 - FRONT_MARGIN;
    let is_beaten = |a: &(f64, [f64; ERRORS])| {
        points.iter().any(|b| {
            let errors = || b.1.iter().zip(&a.1);
            let (is_faster, is_better) = (b.0 < keep * a.0, errors().any(|(b, a)| *b < keep * a));
            let (is_no_slower, is_no_worse) = (b.0 <= a.0, errors().all(|(b, a)| b <= a));
            is_no_worse && (is_faster || is_better && is_no_slower)
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
