// What differs between the releases of Mitsuba and Dr.Jit that the plugin can be compiled against (`RELEASES` in
// build.rs). Everything else here is written for the newest.
#pragma once

#include <string>
#include <string_view>

#include <drjit/traversable_base.h>

#include "rust/cxx.h"

// Before Dr.Jit 1.4 only DRJIT_STRUCT_NODEF had these, which makes constructors as well.
#if !defined(DRJIT_TRAVERSE)
#define DRJIT_TRAVERSE(Name, ...)                                                                                      \
    auto fields_() {                                                                                                   \
        return drjit::tie(__VA_ARGS__);                                                                                \
    }                                                                                                                  \
    auto fields_() const {                                                                                             \
        return drjit::tie(__VA_ARGS__);                                                                                \
    }                                                                                                                  \
    const char *name_() const {                                                                                        \
        return #Name;                                                                                                  \
    }                                                                                                                  \
    auto labels_() const {                                                                                             \
        return drjit::detail::unpack_labels(#__VA_ARGS__, std::make_index_sequence<decltype(fields_())::Size>());      \
    }
#endif

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
