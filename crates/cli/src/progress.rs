//! A progress bar on the terminal for long work: building tables, solving orders.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use sunbeam::table::Progress;

/// Time after which the bar appears; shorter work shows none, since a bar would only flash. With a longer delay the
/// command would seem to hang.
const DELAY: Duration = Duration::from_secs(2);
/// Number of steps of the whole bar, more than a terminal has columns, so that the bar grows smoothly.
const STEPS: u64 = 1000;

/// Label of the bar while tables are built.
pub(crate) const BUILDING: &str = "building tables";

/// A bar on stderr that appears with the first report after [`DELAY`].
struct DelayedBar {
    /// The name of the work, a word or two.
    label: &'static str,
    /// Start of the work.
    start: Instant,
    /// The bar; empty until it appears. Several threads may report, and the first one after the delay creates the bar.
    bar: OnceLock<ProgressBar>,
}

impl DelayedBar {
    /// Shows the fraction of the work that is done, in [0, 1].
    fn show(&self, fraction: f64) {
        if self.start.elapsed() < DELAY {
            return;
        }
        let bar = self.bar.get_or_init(|| {
            let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
            let template = format!("{} {{wide_bar}} {{percent}} %", self.label);
            // The template is valid. If it were not, indicatif's default style would be used.
            match ProgressStyle::with_template(&template) {
                Ok(style) => bar.with_style(style),
                Err(_) => bar,
            }
        });
        bar.set_position((fraction * STEPS as f64) as u64);
    }

    /// Removes the bar, if it has appeared.
    fn clear(&self) {
        if let Some(bar) = self.bar.get() {
            bar.finish_and_clear();
        }
    }
}

/// Runs `work`, and shows the progress that it reports as a bar with this label. The bar is removed at the end.
///
/// Nothing is drawn unless stderr is a terminal.
pub(crate) fn with_bar<T>(label: &'static str, work: impl FnOnce(&Progress) -> T) -> T {
    if !io::stderr().is_terminal() {
        return work(&Progress::none());
    }
    let bar = Arc::new(DelayedBar { label, start: Instant::now(), bar: OnceLock::new() });
    // The listener must own what it uses, so it has a reference of its own.
    let listener = bar.clone();
    let result = work(&Progress::new(move |fraction| listener.show(fraction)));
    bar.clear();
    result
}
