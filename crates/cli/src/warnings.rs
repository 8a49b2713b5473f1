//! Warnings of the library as lines on stderr.

use log::{LevelFilter, Log, Metadata, Record};

/// A logger that prints the messages of this project's crates. Messages of other crates are of no use to users.
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

/// Shows warnings and errors of the log from now on. A second call changes nothing.
pub(crate) fn show() {
    if log::set_logger(&Stderr).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
}
