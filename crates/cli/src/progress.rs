//! A progress bar on the terminal for long work: tables that are built, orders that are solved.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use sunbeam::table::Progress;

/// Time after which the bar appears; shorter work shows none.
const DELAY: Duration = Duration::from_secs(2);
/// Length of the bar in steps.
const STEPS: u64 = 1000;

/// Label of the bar while tables are built.
pub(crate) const BUILDING: &str = "building tables";

/// A bar on stderr that appears after [`DELAY`].
struct DelayedBar {
    /// The name of the work, a word or two.
    label: &'static str,
    start: Instant,
    bar: OnceLock<ProgressBar>,
}

impl DelayedBar {
    /// Shows the fraction of the work that is done.
    fn show(&self, fraction: f64) {
        if self.start.elapsed() < DELAY {
            return;
        }
        let bar = self.bar.get_or_init(|| {
            let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
            // The template is valid; indicatif's own style stands in if it is not.
            let style = ProgressStyle::with_template(&format!("{} {{wide_bar}} {{percent}} %", self.label));
            style.map_or(bar.clone(), |style| bar.clone().with_style(style))
        });
        bar.set_position((fraction * STEPS as f64) as u64);
    }

    fn clear(&self) {
        if let Some(bar) = self.bar.get() {
            bar.finish_and_clear();
        }
    }
}

/// Runs `work` with a progress listener that draws a labelled bar, and removes the bar afterwards.
///
/// Nothing is drawn unless stderr is a terminal.
pub(crate) fn with_bar<T>(label: &'static str, work: impl FnOnce(&Progress) -> T) -> T {
    if !io::stderr().is_terminal() {
        return work(&Progress::none());
    }
    let bar = Arc::new(DelayedBar { label, start: Instant::now(), bar: OnceLock::new() });
    let listener = bar.clone();
    let result = work(&Progress::new(move |fraction| listener.show(fraction)));
    bar.clear();
    result
}
