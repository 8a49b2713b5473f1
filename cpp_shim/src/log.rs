//! Messages for Mitsuba's log: progress while tables are built, and the library's warnings.
//!
//! Only threads that Mitsuba knows may write to its log. The tables are therefore built on a new thread, while the
//! calling thread writes the progress. Warnings may come from any thread; they wait in [`WARNINGS`] until the calling
//! thread writes them.

use ffi::{log_info, log_warn};
use log::{LevelFilter, Log, Metadata, Record};
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
    // SAFETY: the functions take a line by value and keep nothing of it.
    unsafe extern "C++" {
        include!("progress.h");

        /// Writes a line to Mitsuba's log at the level Info.
        fn log_info(line: &str) -> Result<()>;
        /// Writes a line to Mitsuba's log at the level Warn.
        fn log_warn(line: &str) -> Result<()>;
    }
}

/// Time between two progress lines, and before the first. Chosen: quick builds write nothing.
const LOG_INTERVAL: Duration = Duration::from_secs(2);

/// Warnings of the library. Each is written once.
struct Warnings {
    /// Warnings that wait for a thread that may call Mitsuba.
    waiting: Vec<String>,
    /// Every warning so far; `None` before the first.
    seen: Option<HashSet<String>>,
}

/// The warnings of this process.
static WARNINGS: Mutex<Warnings> = Mutex::new(Warnings { waiting: Vec::new(), seen: None });

/// Logger that stores the library's warnings in [`WARNINGS`].
struct WarningLogger;

impl Log for WarningLogger {
    fn enabled(&self, metadata: &Metadata) -> bool {
        metadata.target().starts_with("sunbeam")
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
        // Building goes on if the logger refuses a line.
        let _ = log_warn(&line);
    }
}

/// Runs `build` on another thread, and writes its progress and the library's warnings to Mitsuba's log from this one.
/// Threads that Mitsuba did not start must not call it.
pub(crate) fn logged<T: Send>(build: impl FnOnce(&Progress) -> T + Send) -> T {
    if log::set_logger(&WarningLogger).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
    let built = with_progress(build);
    write_warnings();
    built
}

/// Runs `build` on another thread and writes its progress from this one.
fn with_progress<T: Send>(build: impl FnOnce(&Progress) -> T + Send) -> T {
    // Bits of the fraction done. Non-negative floats have the order of their bits, so an integer maximum works.
    let fraction = Arc::new(AtomicU64::new(0));
    let reported = fraction.clone();
    let progress = Progress::new(move |done| {
        reported.fetch_max(done.max(0.0).to_bits(), Ordering::Relaxed);
    });
    thread::scope(|scope| {
        // Nothing is sent: dropping `alive` ends the wait of the receiver.
        let (alive, ended) = mpsc::channel::<()>();
        let builder = scope.spawn(move || {
            let built = build(&progress);
            drop(alive);
            built
        });
        while ended.recv_timeout(LOG_INTERVAL) == Err(RecvTimeoutError::Timeout) {
            let percent = 100.0 * f64::from_bits(fraction.load(Ordering::Relaxed));
            // Building goes on if the logger refuses a line.
            let _ = log_info(&format!("diffraction: building tables, {percent:.0} %"));
        }
        builder.join().unwrap_or_else(|panic| resume_unwind(panic))
    })
}
