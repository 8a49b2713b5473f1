// Translates Mitsuba's properties into the configuration that the Rust core understands. Independent of the variant.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <mitsuba/core/properties.h>

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

/// Refuses optical constants and reflectances out of range, as far as they are numbers and not textures.
void check_optics(const mitsuba::Properties &props);

/// Refuses parameters that nothing has asked for: misspelt ones and unexpected nested objects.
void refuse_unknown(const mitsuba::Properties &props);

} // namespace sunbeam
