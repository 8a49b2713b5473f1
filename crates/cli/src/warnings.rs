//! Printing of the library's warnings and errors as lines on stderr.

use log::{LevelFilter, Log, Metadata, Record};

/// A logger that prints the messages of this project's crates, whose names all begin with `sunbeam`. The target of a
/// message begins with its crate's name. Messages of other crates, such as wgpu, are left out.
struct StderrLogger;

impl Log for StderrLogger {
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

/// Installs the logger for warnings and errors. A second call changes nothing.
pub(crate) fn show() {
    if log::set_logger(&StderrLogger).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
}
