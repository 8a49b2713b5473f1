#include "progress.h"

#include <string>

#include <mitsuba/core/logger.h>

using mitsuba::ClassName, mitsuba::Info; // for Log()

namespace sunbeam {

void log_info(rust::Str line) {
    Log(Info, "%s", std::string(line));
}

} // namespace sunbeam
