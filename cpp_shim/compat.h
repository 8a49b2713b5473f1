// Code that works with every release of Mitsuba and Dr.Jit that the plugin is compiled against (`RELEASES` in
// build.rs). Elsewhere the code follows the newest release.
#pragma once

#include <string>
#include <string_view>

#include "rust/cxx.h"

namespace sunbeam {

// Conversions between C++ and Rust strings. cxx has such conversions, but compiles them with the `std::string` of the
// C++11 ABI. The wheel of Mitsuba 3.7 uses the older ABI (`_GLIBCXX_USE_CXX11_ABI=0`), with which they do not link.

/// Borrows a text in UTF-8, which must outlive the result. Throws for other encodings.
inline rust::Str rust_str(std::string_view text) {
    return rust::Str(text.data(), text.size());
}

/// Copies a `rust::Str` or `rust::String`.
template <typename Text> std::string std_string(const Text &text) {
    return std::string(text.data(), text.size());
}

} // namespace sunbeam
