// Translates Mitsuba's properties into the configuration that the Rust core understands. Independent of the variant.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <mitsuba/core/properties.h>
#include <mitsuba/core/spectrum.h>

namespace sunbeam {

/// The parameters that describe the surface, those that were given, as a JSON object for `new_surface`.
/// A file name comes out absolute; one that does not exist is an error.
std::string surface_json(const mitsuba::Properties &props);

/// The name of the material, or "none". Refuses unknown ones, `material` beside `eta` or `k`, and `k` without `eta`.
std::string material_name(const mitsuba::Properties &props);

/// A complex index by wavelength: each part at wavelengths in nm of its own, or one value for all of them. Without
/// values, everything is reflected.
struct IndexSpectrum {
    std::vector<double> eta_nm, eta, k_nm, k;
};

/// The index of a material or of `eta` and `k`, as `material_name` has checked them; nothing where it is a colour or a
/// texture, which has no wavelengths.
std::optional<IndexSpectrum> index_spectrum(const mitsuba::Properties &props, const std::string &material);

/// Wavelengths in nm that a spectrum is given for, as far as Mitsuba carries them.
struct WavelengthRange {
    double low = MI_CIE_MIN, high = MI_CIE_MAX;

    bool is_complete() const { return low <= MI_CIE_MIN && high >= MI_CIE_MAX; }
    bool operator==(const WavelengthRange &other) const { return low == other.low && high == other.high; }
};

/// The range of samples at rising wavelengths in nm; the complete one where there is no wavelength.
WavelengthRange range_of(const std::vector<double> &nm);

/// Warns that the spectrum of `source` ends early and is continued by the values at its ends. Refuses one that is given
/// nowhere.
void tell_ends(const std::string &source, const WavelengthRange &range);

/// A spectrum by samples as a property, which goes on to the ends of what Mitsuba carries.
mitsuba::Properties::Spectrum continued(std::vector<double> nm, std::vector<double> values);

/// Refuses optical constants and reflectances out of range, as far as they are numbers and not textures.
void check_optics(const mitsuba::Properties &props);

/// Refuses parameters that nothing has asked for: misspelt ones and unexpected nested objects.
void refuse_unknown(const mitsuba::Properties &props);

} // namespace sunbeam
