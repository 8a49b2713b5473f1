// Compatibility with the Mitsuba that loaded the plugin, checked before any of its objects is used.
#pragma once

#include <string>

namespace sunbeam {

/// Throws a std::runtime_error unless the running Mitsuba is binary compatible with the one compiled against.
/// `address` is any function of the running Mitsuba's core library. The check runs once per process.
void require_compatible(const void *address);

/// Version that the library containing `address` writes into the files it saves; empty if it has none.
std::string library_version(const void *address);

} // namespace sunbeam
