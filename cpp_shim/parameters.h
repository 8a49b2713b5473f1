// Translates Mitsuba's properties into the configuration that the Rust core understands. Independent of the variant.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <mitsuba/core/properties.h>
#include <mitsuba/core/spectrum.h>

namespace sunbeam {

/// The given parameters of the surface as a JSON object for `new_surface`. The file name is made absolute; a missing
/// file is an error.
std::string surface_json(const mitsuba::Properties &props);

/// The name of the material, or "none". Refuses unknown ones, `material` beside `eta` or `k`, and `k` without `eta`.
std::string material_name(const mitsuba::Properties &props);

/// Complex index by wavelength in nm. A part has samples at wavelengths of its own, or one value for all wavelengths.
/// No values: a perfect reflector.
struct IndexSpectrum {
    std::vector<double> eta_nm, eta, k_nm, k;
};

/// Index of a material or of `eta` and `k`, after `material_name` has checked them. Empty for a colour or a texture,
/// which have no wavelengths.
std::optional<IndexSpectrum> index_spectrum(const mitsuba::Properties &props, const std::string &material);

/// Wavelengths in nm that a spectrum is given for, within Mitsuba's range of 360 to 830 nm.
struct WavelengthRange {
    double low = MI_CIE_MIN, high = MI_CIE_MAX;

    bool is_complete() const { return low <= MI_CIE_MIN && high >= MI_CIE_MAX; }
    bool operator==(const WavelengthRange &other) const { return low == other.low && high == other.high; }
};

/// Range of samples at rising wavelengths in nm; the complete range without samples.
WavelengthRange range_of(const std::vector<double> &nm);

/// Warns that the spectrum of `source` ends early and is continued by its end values. Refuses a spectrum without any
/// value in Mitsuba's range.
void tell_ends(const std::string &source, const WavelengthRange &range);

/// A spectrum of samples as a property, continued by its end values to Mitsuba's whole range.
mitsuba::Properties::Spectrum continued(std::vector<double> nm, std::vector<double> values);

/// Refuses optical constants and reflectances out of range. Textures are not checked.
void check_optics(const mitsuba::Properties &props);

/// Refuses parameters that no one has read: misspelt names and unexpected nested objects.
void refuse_unknown(const mitsuba::Properties &props);

} // namespace sunbeam
