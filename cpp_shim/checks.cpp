// Compile-time checks of the layouts of Dr.Jit's arrays, and run-time checks of the Mitsuba that loads the plugin: its
// version, which its core library contains as a string, and its calling convention, which one call tries out.
#include "checks.h"

#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <link.h>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>

#include <mitsuba/core/properties.h>
#include <mitsuba/render/srgb.h>

#include "compat.h"
#include "sunbeam_mitsuba/src/bridge.rs.h"

// The wheel is Mitsuba's package on PyPI. Dr.Jit's small arrays are SIMD registers if and only if the compiler may use
// AVX. With other instruction sets than the wheel's the plugin would compile, load and render garbage. Both sets in
// build.rs, ivybridge and x86-64-v3, contain AVX and F16C; only x86-64-v3 (`SUNBEAM_AVX2`) contains AVX2 and FMA.
#if !defined(__AVX__) || !defined(__F16C__)
#error "compile with the -march of the wheel of Mitsuba"
#endif
#if SUNBEAM_AVX2 ? !defined(__AVX2__) || !defined(__FMA__) : defined(__AVX2__) || defined(__FMA__)
#error "compile with the -march of the wheel of Mitsuba"
#endif

namespace dr = drjit;
// Layouts of small arrays as SIMD registers: three elements take the space of four.
static_assert(sizeof(dr::Array<float, 3>) == 16 && alignof(dr::Array<float, 3>) == 16);
static_assert(sizeof(dr::Array<float, 4>) == 16 && alignof(dr::Array<float, 4>) == 16);
static_assert(sizeof(dr::Array<double, 3>) == 32 && alignof(dr::Array<double, 3>) == 32);
// `SUNBEAM_MITSUBA` is the release that build.rs found.
static_assert(std::string_view(MI_VERSION) == SUNBEAM_MITSUBA, "the headers are not those of the release");

namespace sunbeam {
namespace {

/// Start of a string constant such as "Mitsuba version 3.9.1" in Mitsuba's core library. Mitsuba writes it into the
/// metadata of the images that it saves.
constexpr std::string_view VERSION_LABEL = "Mitsuba version ";

/// Input and result of `search_library`.
struct Search {
    /// Any address inside the library to search.
    uintptr_t address;
    /// Version found; empty if there is none.
    std::string version;
};

/// Callback of `dl_iterate_phdr`, which calls it for each loaded library. Skips libraries that do not contain the
/// address (returns 0). Reads the version from the library that does, and ends the iteration (returns 1).
int search_library(dl_phdr_info *info, size_t, void *payload) {
    auto &search = *static_cast<Search *>(payload);
    // Calls `visit(start, size)` for each readable segment of the library in memory; the size is in bytes.
    auto for_each_segment = [&](auto &&visit) {
        for (int i = 0; i < info->dlpi_phnum; ++i)
            if (const auto &segment = info->dlpi_phdr[i]; segment.p_type == PT_LOAD && (segment.p_flags & PF_R))
                visit(info->dlpi_addr + segment.p_vaddr, segment.p_memsz);
    };
    bool found = false;
    for_each_segment(
        [&](uintptr_t start, size_t size) { found |= search.address >= start && search.address - start < size; });
    if (!found)
        return 0;
    for_each_segment([&](uintptr_t start, size_t size) {
        const std::string_view memory(reinterpret_cast<const char *>(start), size);
        // A label without digits behind it is another string, so the search goes on.
        for (size_t label = memory.find(VERSION_LABEL); label != memory.npos && search.version.empty();
             label        = memory.find(VERSION_LABEL, label + 1)) {
            const size_t begin = label + VERSION_LABEL.size();
            size_t end         = begin;
            while (end < size && (std::isdigit((unsigned char) memory[end]) || memory[end] == '.'))
                ++end;
            search.version = memory.substr(begin, end - begin);
        }
    });
    return 1;
}

/// Version of Mitsuba in the library that contains `address`; empty if none is found.
std::string library_version(const void *address) {
    Search search{ reinterpret_cast<uintptr_t>(address), {} };
    dl_iterate_phdr(search_library, &search);
    return search.version;
}

/// Calls a function of the running library that returns a small array, and throws if the result is not plausible.
void probe_calling_convention() {
    using Array3f = dr::Array<float, 3>;
    // Coefficients of the smooth reflectance spectrum that Mitsuba assigns to a blue in linear sRGB. The library takes
    // the colour by reference and returns the coefficients by value.
    const Array3f coeff = mitsuba::srgb_model_fetch(mitsuba::Color<float, 3>(.1f, .3f, .7f));
    // Mitsuba's model: a sigmoid of a quadratic polynomial in the wavelength.
    auto reflectance = [&](float nm) {
        float v = (coeff.x() * nm + coeff.y()) * nm + coeff.z();
        return .5f * v / std::sqrt(1.f + v * v) + .5f;
    };
    // A blue reflects most at short wavelengths and least at long ones. The bounds are loose, because a wrong calling
    // convention gives arbitrary numbers. Comparisons with NaN are false, so NaN fails.
    const float blue = reflectance(450.f), green = reflectance(540.f), red = reflectance(640.f);
    const bool plausible = blue > .4f && blue <= 1.f && green > .1f && green < blue && red >= 0.f && red < green;
    if (!plausible)
        throw std::runtime_error(
            "the diffraction plugin and the running Mitsuba " MI_VERSION
            " pass arrays in different ways; the latter seems to be built with other compiler flags than the wheel of "
            "PyPI. Use that wheel (pip install mitsuba==" MI_VERSION ").");
}

/// Checks the CPU, the version and the calling convention of the running Mitsuba, whose core library contains
/// `address`. Throws at the first mismatch.
void check(const void *address) {
#if SUNBEAM_AVX2
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
        throw std::runtime_error("the diffraction plugin needs a CPU with AVX2 and FMA, as the wheel of Mitsuba does");
#endif
    // In Rust (src/bridge.rs); throws unless both versions are equal.
    check_version(MI_VERSION, rust_str(library_version(address)));
    probe_calling_convention();
}

} // namespace

void require_compatible(const void *address) {
    static std::once_flag once;
    static std::string refusal;
    std::call_once(once, [&] {
        try {
            check(address);
        } catch (const std::exception &e) {
            refusal = e.what();
        }
    });
    if (!refusal.empty())
        throw std::runtime_error(refusal);
}

} // namespace sunbeam
