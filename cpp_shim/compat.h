// What differs between the releases of Mitsuba and Dr.Jit that the plugin can be compiled against (`RELEASES` in
// build.rs). Everything else here is written for the newest.
#pragma once

#include <string>
#include <string_view>

#include "rust/cxx.h"

namespace sunbeam {

// Strings for Rust and from it. cxx has conversions of its own, but those are compiled apart from this, and where a
// wheel has the `std::string` of before C++11, theirs is another.
inline rust::Str rust_str(std::string_view text) {
    return rust::Str(text.data(), text.size());
}
template <typename Text> std::string std_string(const Text &text) {
    return std::string(text.data(), text.size());
}

} // namespace sunbeam
