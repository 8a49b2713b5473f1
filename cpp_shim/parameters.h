// Checks and converts Mitsuba's properties, independently of the variant. Functions throw Mitsuba's exceptions, whose
// messages name the parameter.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <mitsuba/core/properties.h>
#include <mitsuba/core/spectrum.h>

namespace sunbeam {

/// The given parameters that Rust reads, as a JSON object for the bridge's `new_surface`. Textures of `scale` and
/// `depth` are left out. `filename` becomes an absolute path. Refuses a missing file and numbers that are not finite.
std::string surface_json(const mitsuba::Properties &props);

/// Whether a parameter is given as one number.
bool is_number(const mitsuba::Properties &props, const char *name);

/// Refractive index of the cover by `cover_eta`: a number, the name of one of Mitsuba's media, or a spectrum, of which
/// the value at the sodium line (589.3 nm) is taken. Returns nothing without a cover.
std::optional<double> cover_index(const mitsuba::Properties &props);

/// Index of a body that transmits: `eta`, or `int_ior` over `ext_ior`, by default bk7 and air. Returns nothing for a
/// surface that only reflects. Refuses parameters that contradict transmission, and an outer medium other than air or
/// vacuum.
std::optional<double> transparent_index(const mitsuba::Properties &props);

/// Name of the measured material, or "none". Refuses materials that Mitsuba lacks, `material` together with `eta` or
/// `k`, and `k` without `eta`.
std::string material_name(const mitsuba::Properties &props);

/// Complex refractive index eta + ik. Each part has either values at rising wavelengths in nm, or one value and no
/// wavelengths: a constant. A part that is a colour or a texture has no values, and the index is then unknown. A known
/// index without any values stands for a perfect reflector.
struct IndexSpectrum {
    std::vector<double> eta_nm, eta, k_nm, k;
    bool is_known = true;
};

/// Index of `material`, or of `eta` and `k` if it is "none". `material` comes from `material_name`.
IndexSpectrum index_spectrum(const mitsuba::Properties &props, const std::string &material);

/// Range of wavelengths in nm for which a spectrum has values, cut to Mitsuba's range of 360 to 830 nm. Empty if `low`
/// exceeds `high`.
struct WavelengthRange {
    double low = MI_CIE_MIN, high = MI_CIE_MAX;

    /// Whether the range is Mitsuba's whole range.
    bool is_complete() const { return low <= MI_CIE_MIN && high >= MI_CIE_MAX; }
    bool operator==(const WavelengthRange &other) const { return low == other.low && high == other.high; }
};

/// Range of a spectrum with values at these wavelengths, rising and in nm. The complete range if there are none.
WavelengthRange range_of(const std::vector<double> &nm);

/// Warns if the range of a spectrum is not complete: the spectrum is continued by its end values. Refuses an empty
/// range. `source` names the spectrum in messages.
void check_coverage(const std::string &source, const WavelengthRange &range);

/// Spectrum with as many `values` as rising wavelengths `nm`, at least one. It is continued by its end values to
/// Mitsuba's whole range.
mitsuba::Properties::Spectrum continued(std::vector<double> nm, std::vector<double> values);

/// Refuses values of `eta`, `k`, the reflectances, `specular_transmittance` and `rotation` that are out of range, and
/// `cover_reflection` without a cover. Textures are not checked.
void check_optics(const mitsuba::Properties &props);

/// Refuses parameters that nothing has read: misspelt names and unexpected nested objects. `Optics` (optics.h) calls it
/// after all reads.
void refuse_unknown(const mitsuba::Properties &props);

} // namespace sunbeam
