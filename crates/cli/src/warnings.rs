//! Warnings of the library, as lines on stderr.

use log::{LevelFilter, Log, Metadata, Record};

/// Writes what the library warns of; other libraries' messages are for their own developers.
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

/// Shows warnings from here on; a second call changes nothing.
pub fn show() {
    if log::set_logger(&Stderr).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
}
