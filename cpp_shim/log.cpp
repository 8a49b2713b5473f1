// Calls of Mitsuba's logger on behalf of Rust.
#include "log.h"

#include <mitsuba/core/logger.h>

#include "compat.h"

using mitsuba::ClassName, mitsuba::Info, mitsuba::Warn; // Log() expands to ClassName

namespace sunbeam {

void log_info(rust::Str line) {
    Log(Info, "%s", std_string(line));
}

void log_warn(rust::Str line) {
    Log(Warn, "%s", std_string(line));
}

} // namespace sunbeam
