/// Differences of less than this share of time or error do not put a point behind the front: repeated runs differ by as
/// much.
pub const FRONT_MARGIN: f64 = 0.05;

/// Errors in ΔE₂₀₀₀ below this count as none: a twentieth of what an eye just notices.
const NO_ERROR: f64 = 0.05;

/// Which of the points `(time, error)` no other beats in both. Errors that are not numbers are beaten by any.
pub fn front(points: &[(f64, f64)]) -> Vec<bool> {
    let error = |error: f64| if error.is_nan() { f64::INFINITY } else { error.max(NO_ERROR) };
    let keep = 1.0 - FRONT_MARGIN;
    points
        .iter()
        .map(|a| {
            let beats = |b: &(f64, f64)| {
                let (faster, better) = (b.0 < keep * a.0, error(b.1) < keep * error(a.1));
                let (no_slower, no_worse) = (b.0 <= a.0, error(b.1) <= error(a.1));
                (faster && no_worse) || (better && no_slower)
            };
            !points.iter().any(beats)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_beaten_in_both_is_behind() {
        let points =
            [(1.0, 1.0), (2.0, 0.5), (2.0, 2.0), (1.01, 1.0), (9.0, f64::NAN), (1.5, 1.0), (4.0, 0.01), (8.0, 0.001)];
        assert_eq!(front(&points), [true, true, false, true, false, false, true, false]);
        assert_eq!(front(&[(1.0, f64::NAN)]), [true]);
    }
}
