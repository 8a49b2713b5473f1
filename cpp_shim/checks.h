// What must hold before this plugin may touch an object of the Mitsuba that loaded it.
#pragma once

#include <string>

namespace sunbeam {

/// Throws a std::runtime_error unless the running Mitsuba is binary compatible with the one compiled against.
/// `address` is any function of the running Mitsuba's core library. The answer is found once and remembered.
void require_compatible(const void *address);

/// The version that the library containing `address` writes into the files it saves; empty when there is none.
std::string library_version(const void *address);

} // namespace sunbeam
