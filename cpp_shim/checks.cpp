#include "checks.h"

#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <link.h>
#include <mutex>
#include <stdexcept>
#include <string_view>

#include <mitsuba/core/properties.h>
#include <mitsuba/render/srgb.h>

#include "compat.h"
#include "sunbeam_mitsuba/src/bridge.rs.h"

// Dr.Jit's small arrays are SIMD registers if and only if the compiler may use AVX. The wheels were built with AVX, and
// since 3.9 with AVX2. With other flags the plugin would compile, load and render garbage, so the compiler refuses.
#if !defined(__AVX__) || !defined(__F16C__)
#error "compile with the -march of the wheel of Mitsuba"
#endif
#if SUNBEAM_AVX2 ? !defined(__AVX2__) || !defined(__FMA__) : defined(__AVX2__) || defined(__FMA__)
#error "compile with the -march of the wheel of Mitsuba"
#endif
namespace dr = drjit;
static_assert(sizeof(dr::Array<float, 3>) == 16 && alignof(dr::Array<float, 3>) == 16);
static_assert(sizeof(dr::Array<float, 4>) == 16 && alignof(dr::Array<float, 4>) == 16);
static_assert(sizeof(dr::Array<double, 3>) == 32 && alignof(dr::Array<double, 3>) == 32);
static_assert(std::string_view(MI_VERSION) == SUNBEAM_MITSUBA, "the headers are not those of the release");

namespace sunbeam {
namespace {

/// Label before the version in the metadata of images that Mitsuba saves.
constexpr std::string_view VERSION_LABEL = "Mitsuba version ";

/// Input and result of `search_library`.
struct Search {
    uintptr_t address;
    std::string version;
};

/// Visitor of loaded libraries: reads the version from the library that contains the address.
int search_library(dl_phdr_info *info, size_t, void *payload) {
    auto &search          = *static_cast<Search *>(payload);
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
        for (size_t at = memory.find(VERSION_LABEL); at != memory.npos && search.version.empty();
             at        = memory.find(VERSION_LABEL, at + 1)) {
            size_t end = at += VERSION_LABEL.size();
            while (end < size && (std::isdigit((unsigned char) memory[end]) || memory[end] == '.'))
                ++end;
            search.version = memory.substr(at, end - at);
        }
    });
    return 1;
}

/// Passes small arrays by value to the running library and back, and checks the result.
void probe_calling_convention() {
    using Array3f = dr::Array<float, 3>;
    // Coefficients of a smooth reflectance spectrum of a blue. The library takes the colour by reference and returns
    // the coefficients by value.
    const Array3f coeff = mitsuba::srgb_model_fetch(mitsuba::Color<float, 3>(.1f, .3f, .7f));
    auto reflectance    = [&](float nm) {
        float v = (coeff.x() * nm + coeff.y()) * nm + coeff.z();
        return .5f * v / std::sqrt(1.f + v * v) + .5f;
    };
    const float blue = reflectance(450.f), green = reflectance(540.f), red = reflectance(640.f);
    const bool plausible = blue > .4f && blue <= 1.f && green > .1f && green < blue && red >= 0.f && red < green;
    // Written so that NaN fails.
    if (!plausible)
        throw std::runtime_error(
            "the diffraction plugin and the running Mitsuba " MI_VERSION
            " pass arrays in different ways; the latter seems to be built with other compiler flags than the wheel of "
            "PyPI. Use that wheel (pip install mitsuba==" MI_VERSION ").");
}

/// Throws the reason if the running Mitsuba does not fit.
void check(const void *address) {
#if SUNBEAM_AVX2
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
        throw std::runtime_error("the diffraction plugin needs a CPU with AVX2 and FMA, as the wheel of Mitsuba does");
#endif
    check_version(MI_VERSION, rust_str(library_version(address)));
    probe_calling_convention();
}

} // namespace

std::string library_version(const void *address) {
    Search search{ reinterpret_cast<uintptr_t>(address), {} };
    dl_iterate_phdr(search_library, &search);
    return search.version;
}

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
