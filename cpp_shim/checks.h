// Compatibility with the Mitsuba that loaded the plugin.
#pragma once

namespace sunbeam {

/// Throws a std::runtime_error with the reason unless the running Mitsuba is binary compatible with the one that the
/// plugin was compiled against. `address` is the address of any function in the running Mitsuba's core library. The
/// check runs once per process; later calls repeat its result.
void require_compatible(const void *address);

} // namespace sunbeam
