//! A bar on the terminal while tables are built or orders are solved.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use sunbeam::table::Progress;

/// Work that ends sooner shows nothing.
const PATIENCE: Duration = Duration::from_secs(2);
/// Label of the bar of tables.
pub const BUILDING: &str = "building tables";

/// Steps of the bar.
const STEPS: u64 = 1000;

/// A bar on stderr, where that is a terminal, from two seconds on until all is done or has failed.
struct Bar {
    /// Name of the work, a word or two.
    label: &'static str,
    start: Instant,
    bar: OnceLock<ProgressBar>,
}

impl Bar {
    fn show(&self, share: f64) {
        if self.start.elapsed() < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_init(|| {
            let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
            // The template is fixed; the plain bar would do as well.
            let style = ProgressStyle::with_template(&format!("{} {{wide_bar}} {{percent}} %", self.label));
            style.map_or(bar.clone(), |style| bar.clone().with_style(style))
        });
        bar.set_position((share * STEPS as f64) as u64);
    }

    fn end(&self) {
        if let Some(bar) = self.bar.get() {
            bar.finish_and_clear();
        }
    }
}

/// Runs `work` with a listener that draws the bar behind a label, and takes the bar away afterwards.
pub fn with_bar<T>(label: &'static str, work: impl FnOnce(&Progress) -> T) -> T {
    if !io::stderr().is_terminal() {
        return work(&Progress::none());
    }
    let bar = Arc::new(Bar { label, start: Instant::now(), bar: OnceLock::new() });
    let drawn = bar.clone();
    let done = work(&Progress::new(move |share| drawn.show(share)));
    bar.end();
    done
}
