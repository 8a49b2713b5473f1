//! How far building has come, for whoever waits for it.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

type Report = Arc<dyn Fn(f64) + Send + Sync>;

/// Tells a listener how far a build has come, as a share from 0 to 1 of all its work.
///
/// The listener is called from the threads that build, by several at once and often, so it has to be quick. Shares may
/// arrive slightly out of order.
#[derive(Clone)]
pub struct Progress {
    report: Option<Report>,
    /// The part of the whole that this one stands for.
    from: f64,
    to: f64,
}

impl Progress {
    /// Nobody listens.
    pub fn none() -> Self {
        Self { report: None, from: 0.0, to: 1.0 }
    }

    /// Calls `listener` with the share that is done.
    pub fn new(listener: impl Fn(f64) + Send + Sync + 'static) -> Self {
        Self { report: Some(Arc::new(listener)), from: 0.0, to: 1.0 }
    }

    /// The part of this one's work between the shares `from` and `to`, whose own shares count from 0 to 1 again.
    #[must_use]
    pub fn part(&self, from: f64, to: f64) -> Self {
        let place = |share: f64| self.from + share * (self.to - self.from);
        Self { report: self.report.clone(), from: place(from), to: place(to) }
    }

    /// Says that so much of the work is done.
    pub fn report(&self, share: f64) {
        if let Some(report) = &self.report {
            report(self.from + share.clamp(0.0, 1.0) * (self.to - self.from));
        }
    }

    /// For work of `steps` equal steps, which may be done by several threads.
    pub fn of_steps(&self, steps: usize) -> Steps {
        Steps { progress: self.clone(), steps, done: AtomicUsize::new(0) }
    }
}

/// Tells a [`Progress`] of steps.
#[derive(Debug)]
pub struct Steps {
    progress: Progress,
    steps: usize,
    done: AtomicUsize,
}

impl Steps {
    /// Says that one more step is done.
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
        let whole = Progress::new(move |share| ears.lock().unwrap().push(share));
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
