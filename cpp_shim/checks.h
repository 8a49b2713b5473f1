// Compatibility with the Mitsuba that loaded the plugin.
#pragma once

namespace sunbeam {

/// Throws a std::runtime_error with the reason if the plugin does not suit the process. The CPU must have the plugin's
/// instructions, and the running Mitsuba the version and calling convention that the plugin was compiled for. `address`
/// is that of any function in Mitsuba's core library. The check runs once per process; later calls repeat its result.
void require_compatible(const void *address);

} // namespace sunbeam
