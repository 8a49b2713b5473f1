//! The Pareto front of a benchmark's times and errors: the entries that no other entry beats ([`Cost::beats`]).

/// Relative advantage in time or in an error that an entry needs to beat another. Times of repeated runs differ by
/// about this. With a smaller value, noise decides which of two similar entries is on the front; a larger one keeps
/// more entries.
const MARGIN: f64 = 0.05;

/// ΔE₂₀₀₀ (colour difference by CIEDE2000) below which entries count as equally good. A difference of 1 is just
/// noticeable, so a twentieth cannot be seen. With a smaller limit, more entries that look alike are on the front.
const DELTA_E_MIN: f64 = 0.05;

/// A ΔE₂₀₀₀ for [`Cost::errors`]: at least [`DELTA_E_MIN`], which makes all smaller values equal. A NaN stays.
pub(crate) fn clamp_delta_e(delta_e: f64) -> f64 {
    delta_e.clamp(DELTA_E_MIN, f64::INFINITY)
}

/// Time and errors of an entry, the coordinates in which a Pareto front is found. Smaller is better in each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost<const ERRORS: usize> {
    /// Time per colour in µs; finite.
    time_us: f64,
    /// One error of each kind, in the same order for all entries that are compared. None is NaN.
    errors: [f64; ERRORS],
}

impl<const ERRORS: usize> Cost<ERRORS> {
    /// The cost of an entry with this time in µs and these errors. A NaN counts as an infinite error.
    pub(crate) fn new(time_us: f64, errors: [f64; ERRORS]) -> Self {
        Self { time_us, errors: errors.map(|error| if error.is_nan() { f64::INFINITY } else { error }) }
    }

    /// Whether none of `rivals` beats this entry. The entry itself may be among them: it does not beat itself.
    pub(crate) fn is_on_front(&self, rivals: impl IntoIterator<Item = Self>) -> bool {
        !rivals.into_iter().any(|rival| rival.beats(self))
    }

    /// Whether this entry beats the other: none of its errors is larger, and it is either faster, or no slower and
    /// better in one error. "Faster" and "better" mean smaller by more than [`MARGIN`].
    fn beats(&self, other: &Self) -> bool {
        let is_clearly_less = |a: f64, b: f64| a < (1.0 - MARGIN) * b;
        let error_pairs = || self.errors.into_iter().zip(other.errors);
        let is_no_worse = error_pairs().all(|(own, others)| own <= others);
        let is_better = error_pairs().any(|(own, others)| is_clearly_less(own, others));
        let is_faster = is_clearly_less(self.time_us, other.time_us);
        is_no_worse && (is_faster || is_better && self.time_us <= other.time_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether each of the entries `(time in µs, errors)` is on their Pareto front.
    fn front<const ERRORS: usize>(entries: &[(f64, [f64; ERRORS])]) -> Vec<bool> {
        let costs: Vec<_> = entries.iter().map(|(time_us, errors)| Cost::new(*time_us, *errors)).collect();
        costs.iter().map(|cost| cost.is_on_front(costs.iter().copied())).collect()
    }

    #[test]
    fn an_entry_beaten_in_time_and_error_is_behind_the_front() {
        let entries = [
            (1.0, 1.0),
            (2.0, 0.5),
            (2.0, 2.0),
            // Slower than the first, but within the margin.
            (1.01, 1.0),
            (9.0, f64::NAN),
            (1.5, 1.0),
            (4.0, 0.01),
            // No better than the previous entry: both errors are below `DELTA_E_MIN`.
            (8.0, 0.001),
        ];
        let entries = entries.map(|(time_us, delta_e)| (time_us, [clamp_delta_e(delta_e)]));
        assert_eq!(front(&entries), [true, true, false, true, false, false, true, false]);
        assert_eq!(front(&[(1.0, [f64::NAN])]), [true]);
    }

    #[test]
    fn an_entry_better_by_one_error_is_on_the_front() {
        let entries = [(1.0, [2.0, 9.0]), (2.0, [1.9, 9.0]), (3.0, [2.0, 8.0]), (4.0, [1.9, 8.5]), (5.0, [1.9, 8.5])];
        // Only the last is beaten: the fourth has the same errors and is faster.
        assert_eq!(front(&entries), [true, true, true, true, false]);
    }
}
