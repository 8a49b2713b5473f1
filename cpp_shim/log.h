// Lines for Mitsuba's log, written by Rust (src/log.rs). Only threads on which Mitsuba has called the plugin may write
// them. Mitsuba's logger may throw; cxx turns the exception into an error for Rust.
#pragma once

#include "rust/cxx.h"

namespace sunbeam {

/// Writes a line at the level Info.
void log_info(rust::Str line);

/// Writes a line at the level Warn.
void log_warn(rust::Str line);

} // namespace sunbeam
