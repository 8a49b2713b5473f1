// Lines for Mitsuba's log (src/log.rs).
#pragma once

#include "rust/cxx.h"

namespace sunbeam {

/// Writes a line to Mitsuba's log at the level Info. Only for the thread that Mitsuba called the plugin from.
void log_info(rust::Str line);

/// Writes a line to Mitsuba's log at the level Warn. Only for the thread that Mitsuba called the plugin from.
void log_warn(rust::Str line);

} // namespace sunbeam
