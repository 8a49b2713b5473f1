//! Warnings of the library as lines on stderr.

use log::{LevelFilter, Log, Metadata, Record};

/// A logger for the messages of this project's crates; those of other crates are for their own developers.
struct Stderr;

impl Log for Stderr {
    fn enabled(&self, metadata: &Metadata) -> bool {
        metadata.target().starts_with("sunbeam")
    }

    fn log(&self, record: &Record) {
        if self.enabled(record.metadata()) {
            eprintln!("sunbeam: {}", record.args());
        }
    }

    fn flush(&self) {}
}

/// Shows warnings from now on; a second call changes nothing.
pub(crate) fn show() {
    if log::set_logger(&Stderr).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
}
