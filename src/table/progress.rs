//! Progress of a build, reported to a listener.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Function that is called with the fraction of the work that is done, 0 to 1.
type Listener = Arc<dyn Fn(f64) + Send + Sync>;

/// Reporter of a build's progress to a listener, which gets the finished fraction of the whole work, from 0 to 1. A
/// reporter serves the whole work or a part of it ([`Progress::part`]).
///
/// The listener is called often and from several threads at once, so it has to be fast. Fractions may arrive slightly
/// out of order.
///
/// ```
/// use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
/// use std::sync::Arc;
/// use sunbeam::table::Progress;
///
/// let percent = Arc::new(AtomicU64::new(0));
/// let shown = percent.clone();
/// let progress = Progress::new(move |fraction| shown.store((100.0 * fraction) as u64, Relaxed));
/// let (first, second) = progress.halves();
/// first.report(1.0);
/// assert_eq!(percent.load(Relaxed), 50);
/// // Four equal steps in the second half.
/// let steps = second.of_steps(4);
/// steps.one();
/// assert_eq!(percent.load(Relaxed), 62);
/// ```
#[derive(Clone)]
pub struct Progress {
    listener: Option<Listener>,
    /// Fraction of the whole work at which this part begins.
    from: f64,
    /// Fraction of the whole work at which this part ends.
    to: f64,
}

impl Progress {
    /// Progress without a listener.
    pub fn none() -> Self {
        Self { listener: None, from: 0.0, to: 1.0 }
    }

    /// Progress that calls `listener` with the fraction of the whole work that is done.
    pub fn new(listener: impl Fn(f64) + Send + Sync + 'static) -> Self {
        Self { listener: Some(Arc::new(listener)), from: 0.0, to: 1.0 }
    }

    /// Part of this progress between the fractions `from` and `to`, 0 to 1. Fractions that are reported to the part run
    /// from 0 to 1 again.
    #[must_use]
    pub fn part(&self, from: f64, to: f64) -> Self {
        Self { listener: self.listener.clone(), from: self.of_whole(from), to: self.of_whole(to) }
    }

    /// Both halves of this progress, for two tasks whose shares of the time are unknown.
    pub fn halves(&self) -> (Self, Self) {
        (self.part(0.0, 0.5), self.part(0.5, 1.0))
    }

    /// Reports the fraction of this part that is done, clamped to 0 to 1.
    pub fn report(&self, fraction: f64) {
        if let Some(listener) = &self.listener {
            listener(self.of_whole(fraction.clamp(0.0, 1.0)));
        }
    }

    /// Fraction of the whole work at a fraction of this part.
    fn of_whole(&self, fraction: f64) -> f64 {
        self.from + fraction * (self.to - self.from)
    }

    /// Counter of `steps` equal steps, which several threads may share.
    pub fn of_steps(&self, steps: usize) -> Steps {
        Steps { progress: self.clone(), steps, done: AtomicUsize::new(0) }
    }
}

/// Counter of the steps of a [`Progress`]; from [`Progress::of_steps`].
#[derive(Debug)]
pub struct Steps {
    progress: Progress,
    steps: usize,
    /// Number of steps that are done.
    done: AtomicUsize,
}

impl Steps {
    /// Reports that one more step is done.
    pub fn one(&self) {
        let before = self.done.fetch_add(1, Ordering::Relaxed);
        self.progress.report((before + 1) as f64 / self.steps.max(1) as f64);
    }
}

impl fmt::Debug for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Progress({}..{}, listener: {})", self.from, self.to, self.listener.is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn parts_report_fractions_of_the_whole() {
        let reported = Arc::new(Mutex::new(Vec::new()));
        let list = reported.clone();
        let whole = Progress::new(move |fraction| list.lock().unwrap().push(fraction));
        let (_, second_half) = whole.halves();
        whole.report(0.25);
        second_half.report(0.0);
        second_half.part(0.5, 0.75).report(2.0);
        let steps = second_half.of_steps(4);
        (0..2).for_each(|_| steps.one());
        assert_eq!(*reported.lock().unwrap(), [0.25, 0.5, 0.875, 0.625, 0.75]);
    }

    #[test]
    fn progress_without_a_listener_reports_nothing() {
        Progress::none().part(0.0, 0.5).report(1.0);
    }
}
