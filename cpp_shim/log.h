// Lines for Mitsuba's log (src/log.rs). Only threads on which Mitsuba has called the plugin may write them. Mitsuba's
// logger may throw, which cxx turns into an error for Rust.
#pragma once

#include "rust/cxx.h"

namespace sunbeam {

/// Writes a line at the level Info.
void log_info(rust::Str line);

/// Writes a line at the level Warn.
void log_warn(rust::Str line);

} // namespace sunbeam
