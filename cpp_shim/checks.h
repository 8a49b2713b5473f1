// Compatibility with the Mitsuba that loaded the plugin.
#pragma once

namespace sunbeam {

/// Throws a std::runtime_error with the reason unless the plugin was compiled for the CPU's instructions, and for the
/// version and the calling convention of the running Mitsuba. `address` is that of any function in its core library.
/// The check runs once per process; later calls repeat its result.
void require_compatible(const void *address);

} // namespace sunbeam
