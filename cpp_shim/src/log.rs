//! Messages for Mitsuba's log: progress while tables are built, and the library's warnings.

use super::bridge::{log_info, log_warn};
use log::{LevelFilter, Log, Metadata, Record};
use std::collections::HashSet;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use sunbeam::table::Progress;

/// Between two lines of Mitsuba's log, and before the first.
const LOG_INTERVAL: Duration = Duration::from_secs(2);

/// Warnings that wait for a thread that may call Mitsuba, and all that were ever told: each is told once.
struct Warnings {
    waiting: Vec<String>,
    told: Option<HashSet<String>>,
}

static WARNINGS: Mutex<Warnings> = Mutex::new(Warnings { waiting: Vec::new(), told: None });

/// The library's logger: keeps its warnings.
struct Keep;

impl Log for Keep {
    fn enabled(&self, metadata: &Metadata) -> bool {
        metadata.target().starts_with("sunbeam")
    }

    fn log(&self, record: &Record) {
        if self.enabled(record.metadata()) {
            let line = format!("diffraction: {}", record.args());
            let mut warnings = WARNINGS.lock().unwrap_or_else(PoisonError::into_inner);
            if warnings.told.get_or_insert_default().insert(line.clone()) {
                warnings.waiting.push(line);
            }
        }
    }

    fn flush(&self) {}
}

/// Hands the warnings to Mitsuba's log.
fn tell_warnings() {
    let waiting = std::mem::take(&mut WARNINGS.lock().unwrap_or_else(PoisonError::into_inner).waiting);
    for line in waiting {
        // A logger that refuses a line is no reason not to build.
        let _ = log_warn(&line);
    }
}

/// Runs `build` and tells Mitsuba's log how far it has come and what the library warns of, from this thread alone: others
/// must not call Mitsuba.
pub fn logged<T: Send>(build: impl FnOnce(&Progress) -> T + Send) -> T {
    if log::set_logger(&Keep).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
    let built = with_progress(build);
    tell_warnings();
    built
}

fn with_progress<T: Send>(build: impl FnOnce(&Progress) -> T + Send) -> T {
    // Bits of a share. Those of positive floats are in the order of their values.
    let share = Arc::new(AtomicU64::new(0));
    let told = share.clone();
    let progress = Progress::new(move |done| {
        told.fetch_max(done.max(0.0).to_bits(), Ordering::Relaxed);
    });
    thread::scope(|scope| {
        let (alive, ended) = mpsc::channel::<()>();
        let builder = scope.spawn(move || {
            let built = build(&progress);
            drop(alive);
            built
        });
        while ended.recv_timeout(LOG_INTERVAL) == Err(RecvTimeoutError::Timeout) {
            let percent = 100.0 * f64::from_bits(share.load(Ordering::Relaxed));
            // A logger that refuses a line is no reason not to build.
            let _ = log_info(&format!("diffraction: building tables, {percent:.0} %"));
        }
        builder.join().unwrap_or_else(|panic| resume_unwind(panic))
    })
}
