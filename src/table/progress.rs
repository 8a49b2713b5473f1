//! Progress of a build, reported to a listener as a fraction of its work.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

type Report = Arc<dyn Fn(f64) + Send + Sync>;

/// Reports the fraction of a build's work that is done, from 0 to 1.
///
/// The listener is called often, from several threads at once, so it has to be quick. Fractions may arrive slightly out
/// of order.
///
/// ```
/// use std::sync::{Arc, Mutex};
/// use sunbeam::table::Progress;
///
/// let heard = Arc::new(Mutex::new(0.0));
/// let listener = heard.clone();
/// let progress = Progress::new(move |fraction| *listener.lock().unwrap() = fraction);
/// progress.part(0.5, 1.0).report(0.5);
/// assert_eq!(*heard.lock().unwrap(), 0.75);
/// ```
#[derive(Clone)]
pub struct Progress {
    /// Listener; `None` where nobody listens.
    report: Option<Report>,
    /// Fractions of the whole work at which this part begins and ends.
    from: f64,
    to: f64,
}

impl Progress {
    /// Progress without a listener.
    pub fn none() -> Self {
        Self { report: None, from: 0.0, to: 1.0 }
    }

    /// Progress that calls `listener` with the fraction done, from 0 to 1.
    pub fn new(listener: impl Fn(f64) + Send + Sync + 'static) -> Self {
        Self { report: Some(Arc::new(listener)), from: 0.0, to: 1.0 }
    }

    /// Part of this work from the fraction `from` to `to`; fractions of the part count from 0 to 1 again.
    #[must_use]
    pub fn part(&self, from: f64, to: f64) -> Self {
        let position = |fraction: f64| self.from + fraction * (self.to - self.from);
        Self { report: self.report.clone(), from: position(from), to: position(to) }
    }

    /// Reports that `fraction` of this part's work is done; clamped to [0, 1].
    pub fn report(&self, fraction: f64) {
        if let Some(report) = &self.report {
            report(self.from + fraction.clamp(0.0, 1.0) * (self.to - self.from));
        }
    }

    /// Counter of `steps` equal steps, which several threads may do.
    pub fn of_steps(&self, steps: usize) -> Steps {
        Steps { progress: self.clone(), steps, done: AtomicUsize::new(0) }
    }
}

/// Counter of equal steps of a [`Progress`].
#[derive(Debug)]
pub struct Steps {
    progress: Progress,
    steps: usize,
    done: AtomicUsize,
}

impl Steps {
    /// Reports one more step as done.
    pub fn one(&self) {
        let before = self.done.fetch_add(1, Ordering::Relaxed);
        self.progress.report((before + 1) as f64 / self.steps.max(1) as f64);
    }
}

impl fmt::Debug for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Progress({}..{}, listener: {})", self.from, self.to, self.report.is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn parts_of_parts_count_within_the_whole() {
        let heard = Arc::new(Mutex::new(Vec::new()));
        let ears = heard.clone();
        let whole = Progress::new(move |fraction| ears.lock().unwrap().push(fraction));
        let second_half = whole.part(0.5, 1.0);
        whole.report(0.25);
        second_half.report(0.0);
        second_half.part(0.5, 0.75).report(2.0);
        let steps = second_half.of_steps(4);
        (0..2).for_each(|_| steps.one());
        assert_eq!(*heard.lock().unwrap(), [0.25, 0.5, 0.875, 0.625, 0.75]);
        Progress::none().part(0.0, 0.5).report(1.0);
    }
}
