//! What Mitsuba's log is told while tables are built.

use super::bridge::log_info;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;
use sunbeam::table::Progress;

/// Between two lines of Mitsuba's log, and before the first.
const LOG_INTERVAL: Duration = Duration::from_secs(2);

/// Runs `build` and tells Mitsuba's log how far it has come, from this thread alone: others must not call Mitsuba.
pub fn logged<T: Send>(build: impl FnOnce(&Progress) -> T + Send) -> T {
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
