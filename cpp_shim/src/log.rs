//! Messages for Mitsuba's log: progress while tables are built, and the library's warnings.
//!
//! Only threads that Mitsuba knows may write to its log (log.h says why). Therefore tables are built on a new thread,
//! while the calling thread writes the progress. Warnings may come from any thread. They wait in [`WARNINGS`] until the
//! build has ended and the calling thread writes them.

use ffi::{log_info, log_warn};
use log::{Level, LevelFilter, Log, Metadata, Record};
use std::collections::HashSet;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use sunbeam::table::Progress;

#[allow(unreachable_pub, reason = "cxx declares all functions public")]
#[cxx::bridge(namespace = "sunbeam")]
mod ffi {
    // SAFETY: the functions keep no reference to the line.
    unsafe extern "C++" {
        include!("log.h");

        /// Writes a line to Mitsuba's log at the level Info.
        fn log_info(line: &str) -> Result<()>;
        /// Writes a line to Mitsuba's log at the level Warn.
        fn log_warn(line: &str) -> Result<()>;
    }
}

/// Time before the first progress line, and between two lines. A shorter interval also reports quick builds; a longer
/// one leaves slow builds silent for longer.
const LOG_INTERVAL: Duration = Duration::from_secs(2);

/// Warnings of the library. Each text is written once per process.
struct Warnings {
    /// Warnings that wait for a thread that may call Mitsuba.
    waiting: Vec<String>,
    /// Every warning so far. `None` before the first, since `HashSet::new` cannot initialise a static.
    seen: Option<HashSet<String>>,
}

/// Warnings of this process.
static WARNINGS: Mutex<Warnings> = Mutex::new(Warnings { waiting: Vec::new(), seen: None });

/// Logger that stores the library's warnings in [`WARNINGS`].
struct WarningLogger;

impl Log for WarningLogger {
    fn enabled(&self, metadata: &Metadata) -> bool {
        metadata.target().starts_with("sunbeam") && metadata.level() <= Level::Warn
    }

    fn log(&self, record: &Record) {
        if self.enabled(record.metadata()) {
            let line = format!("diffraction: {}", record.args());
            let mut warnings = WARNINGS.lock().unwrap_or_else(PoisonError::into_inner);
            if warnings.seen.get_or_insert_default().insert(line.clone()) {
                warnings.waiting.push(line);
            }
        }
    }

    fn flush(&self) {}
}

/// Writes the waiting warnings to Mitsuba's log.
fn write_warnings() {
    let waiting = std::mem::take(&mut WARNINGS.lock().unwrap_or_else(PoisonError::into_inner).waiting);
    for line in waiting {
        // A line that Mitsuba's logger refuses is dropped.
        let _ = log_warn(&line);
    }
}

/// Runs `build` on a new thread, and writes its progress and the library's warnings to Mitsuba's log. A panic of
/// `build` continues on this thread.
///
/// Only for threads on which Mitsuba calls the plugin. surface.rs guarantees it: it calls this function while Mitsuba
/// makes or changes a BSDF.
pub(crate) fn logged<T: Send>(build: impl FnOnce(&Progress) -> T + Send) -> T {
    // Fails on all calls but the first, and if the process has another logger, which then receives the warnings.
    if log::set_logger(&WarningLogger).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
    let built = with_progress(build);
    write_warnings();
    built.unwrap_or_else(|panic| resume_unwind(panic))
}

/// Runs `build` on a new thread and writes its progress from this one. A panic of `build` is returned.
fn with_progress<T: Send>(build: impl FnOnce(&Progress) -> T + Send) -> thread::Result<T> {
    // Largest fraction reported, as bits of an `f64`. Non-negative floats have the same order as their bits.
    let fraction_bits = Arc::new(AtomicU64::new(0));
    let reported = fraction_bits.clone();
    let progress = Progress::new(move |fraction| {
        reported.fetch_max(fraction.max(0.0).to_bits(), Ordering::Relaxed);
    });
    thread::scope(|scope| {
        // Nothing is sent. The sender is dropped when the build ends or panics, which ends the loop below.
        let (alive, ended) = mpsc::channel::<()>();
        let builder = scope.spawn(move || {
            let built = build(&progress);
            drop(alive);
            built
        });
        while ended.recv_timeout(LOG_INTERVAL) == Err(RecvTimeoutError::Timeout) {
            let percent = 100.0 * f64::from_bits(fraction_bits.load(Ordering::Relaxed));
            // A line that Mitsuba's logger refuses is dropped.
            let _ = log_info(&format!("diffraction: building tables, {percent:.0} %"));
        }
        builder.join()
    })
}
