// Lines for Mitsuba's log, written by Rust (src/log.rs). Only threads on which Mitsuba has called the plugin may write:
// older supported releases of Mitsuba keep the logger in an object of each thread, which threads made by Rust lack.
// Mitsuba's logger may throw. The bridge in src/log.rs declares both functions with `Result`, so cxx turns the
// exception into an `Err`.
#pragma once

#include "rust/cxx.h"

namespace sunbeam {

/// Writes a line at the level Info. The text does not end with a newline, which Mitsuba adds.
void log_info(rust::Str line);

/// Writes a line at the level Warn, also without a newline.
void log_warn(rust::Str line);

} // namespace sunbeam
