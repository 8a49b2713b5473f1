// Reading of the plugin's parameters. Choices and numbers go to Rust as JSON, and Rust checks their ranges. Parameters
// that Mitsuba gives as names of media, spectra or textures are read and checked here.
#include "parameters.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <vector>

#include <mitsuba/core/filesystem.h>
#include <mitsuba/core/fresolver.h>
#include <mitsuba/core/logger.h>
#include <mitsuba/core/spectrum.h>
#include <mitsuba/render/ior.h>

using mitsuba::ClassName, mitsuba::Error; // Throw() expands to both
using mitsuba::Properties;

namespace sunbeam {
namespace {

// Parameters that go to Rust, by type: strings, numbers and booleans. src/config/ decides which values are accepted.
constexpr const char *CHOICES[] = {
    "preset", "fill", "level", "tiling", "theory", "model", "obliquity", "transmission"
};
constexpr const char *NUMBERS[] = { "period",     "height",           "region_size", "region_spread", "pixel_size",
                                    "max_height", "coherence_length", "tolerance",   "build_limit" };
// Parameters that go to Rust as numbers and are textures otherwise.
constexpr const char *SIZES[]    = { "scale", "depth" };
constexpr const char *SWITCHES[] = { "conserve_energy", "shadowing" };

// Parameters that are read only where light is transmitted. Elsewhere `refuse_unknown` refuses them as unread.
constexpr const char *TRANSMISSION_ONLY[] = { "back_reflection", "int_ior", "ext_ior", "specular_transmittance" };

// All parameters of the plugin, for messages. Those up to build_limit go to Rust, as does `eta` where light is
// transmitted. tests/test_docs.py compares the list with docs/plugin.md.
constexpr const char *ALL_NAMES =
    "preset, period, height, region_size, region_spread, filename, pixel_size, max_height, channel, fill, level, "
    "tiling, scale, depth, theory, coherence_length, model, obliquity, conserve_energy, shadowing, cover_eta, "
    "transmission, tolerance, build_limit, cover_reflection, back_reflection, material, eta, k, int_ior, ext_ior, "
    "specular_reflectance, specular_transmittance, diffuse_reflectance, rotation";

/// Wavelength in nm of the sodium line, at which the indices of media are commonly given.
constexpr double SODIUM_NM = 589.3;

/// Largest difference of the outer medium's index from 1. It accepts vacuum and air, whose index is 1.00028.
constexpr double AIR_TOLERANCE = 1e-3;

/// JSON string literal of a text in UTF-8.
std::string json_string(std::string_view text) {
    std::string result = "\"";
    for (unsigned char c : text) {
        if (c == '"' || c == '\\') {
            result += '\\';
            result += (char) c;
        } else if (c < 0x20) {
            char escape[8];
            std::snprintf(escape, sizeof escape, "\\u%04x", c);
            result += escape;
        } else {
            result += (char) c;
        }
    }
    return result + '"';
}

/// JSON number of a parameter's value. Refuses infinities and NaN.
std::string json_number(const char *name, double value) {
    if (!std::isfinite(value))
        Throw("parameter \"%s\" is %.9g, but must be a finite number", name, value);
    // The shortest form that reads back as the same number, at most 24 characters. Unlike printf's, it does not depend
    // on the locale.
    char text[32];
    return std::string(text, std::to_chars(text, text + sizeof text, value).ptr);
}

/// JSON number of a parameter.
std::string json_number(const Properties &props, const char *name) {
    if (!is_number(props, name))
        Throw("parameter \"%s\" must be a float, one number for the whole surface", name);
    return json_number(name, props.get<double>(name));
}

/// Absolute path of the file that Mitsuba's file resolver finds for `filename`. Refuses a missing file.
std::string resolved_file(const Properties &props) {
    namespace fs           = mitsuba::fs;
    const std::string name = props.get<std::string>("filename");
    const fs::path path    = mitsuba::file_resolver()->resolve(fs::path(name));
    if (!fs::is_regular_file(path))
        Throw("parameter \"filename\": there is no file \"%s\" in any folder of the file resolver", name);
    return fs::absolute(path).string();
}

/// Numbers of a parameter: one number, the three channels of a colour, or the values of a spectrum. Empty for other
/// types, such as a texture.
std::vector<double> plain_values(const Properties &props, const char *name) {
    switch (props.type(name)) {
        case Properties::Type::Float:
        case Properties::Type::Integer:
            return { props.get<double>(name) };
        case Properties::Type::Color: {
            const auto color = props.get<mitsuba::Color<double, 3>>(name);
            return { color.x(), color.y(), color.z() };
        }
        case Properties::Type::Spectrum:
            return props.get<Properties::Spectrum>(name).values;
        default:
            return {};
    }
}

/// Refuses numbers of a parameter outside [low, high], infinities and NaN. `accepted` completes the message "but must
/// be …".
void check_range(const Properties &props, const char *name, double low, double high, const char *accepted) {
    if (!props.has_property(name))
        return;
    for (double value : plain_values(props, name))
        if (!(std::isfinite(value) && value >= low && value <= high))
            Throw("parameter \"%s\" is %.9g, but must be %s", name, value, accepted);
}

/// "none" and the sorted names of the measured materials that come with Mitsuba, joined by commas.
std::string known_materials() {
    std::vector<std::string> names;
    const auto folder             = mitsuba::file_resolver()->resolve(mitsuba::fs::path("data/ior"));
    const std::string_view suffix = ".eta.spd";
    std::error_code error; // an unreadable folder yields an empty list
    for (const auto &entry : std::filesystem::directory_iterator(folder.string(), error)) {
        std::string name = entry.path().filename().string();
        if (name.size() > suffix.size() && name.compare(name.size() - suffix.size(), suffix.npos, suffix) == 0)
            names.push_back(name.substr(0, name.size() - suffix.size()));
    }
    std::sort(names.begin(), names.end());
    std::string list = "none";
    for (const auto &name : names)
        (list += ", ") += name;
    return list;
}

/// Refractive index by the parameter `name`, a number or the name of a medium. `default_medium` is taken if the
/// parameter is not given.
double medium_index(const Properties &props, const char *name, const char *default_medium) {
    // `lookup_ior` refuses integers.
    if (props.has_property(name) && props.type(name) == Properties::Type::Integer)
        return props.get<double>(name);
    return mitsuba::lookup_ior(props, name, default_medium);
}

} // namespace

bool is_number(const Properties &props, const char *name) {
    if (!props.has_property(name))
        return false;
    const auto type = props.type(name);
    return type == Properties::Type::Float || type == Properties::Type::Integer;
}

std::string surface_json(const Properties &props) {
    std::string json;
    auto append = [&](const char *name, const std::string &value) {
        json += json.empty() ? "{" : ",";
        json += json_string(name) + ":" + value;
    };
    for (const char *name : CHOICES)
        if (props.has_property(name))
            append(name, json_string(props.get<std::string>(name)));
    for (const char *name : NUMBERS)
        if (props.has_property(name))
            append(name, json_number(props, name));
    for (const char *name : SIZES)
        if (is_number(props, name))
            append(name, json_number(props, name));
    for (const char *name : SWITCHES)
        if (props.has_property(name))
            append(name, props.get<bool>(name) ? "true" : "false");
    // A channel is given by its number or by its title.
    if (props.has_property("channel"))
        append("channel", props.type("channel") == Properties::Type::Integer
                              ? std::to_string(props.get<int64_t>("channel"))
                              : json_string(props.get<std::string>("channel")));
    // A cover and a body that transmits have one index for the whole surface; `index_spectrum` reads other indices.
    for (const auto &[name, eta] :
         { std::pair("cover_eta", cover_index(props)), std::pair("eta", transparent_index(props)) })
        if (eta)
            append(name, json_number(name, *eta));
    if (props.has_property("filename"))
        append("filename", json_string(resolved_file(props)));
    return json.empty() ? "{}" : json + "}";
}

std::optional<double> cover_index(const Properties &props) {
    if (!props.has_property("cover_eta"))
        return {};
    switch (props.type("cover_eta")) {
        case Properties::Type::Float:
        case Properties::Type::Integer:
            return props.get<double>("cover_eta");
        case Properties::Type::String:
            // Mitsuba's indices have up to six decimals. `lookup_ior` returns them in single precision, and the
            // rounding restores the decimal number.
            return std::round(1e6 * mitsuba::lookup_ior(props, "cover_eta", "air")) / 1e6;
        case Properties::Type::Spectrum: {
            const auto &spectrum = props.get<Properties::Spectrum>("cover_eta");
            const auto &nm = spectrum.wavelengths, &values = spectrum.values;
            // Linear interpolation between the wavelengths around the sodium line, or the value at the nearer end. A
            // uniform spectrum has one value and no wavelengths.
            const size_t above = std::upper_bound(nm.begin(), nm.end(), SODIUM_NM) - nm.begin();
            if (above == 0 || above == nm.size())
                return above == 0 ? values.front() : values.back();
            const double fraction = (SODIUM_NM - nm[above - 1]) / (nm[above] - nm[above - 1]);
            return values[above - 1] + fraction * (values[above] - values[above - 1]);
        }
        default:
            Throw("parameter \"cover_eta\" must be a float, the name of a medium as of \"int_ior\", or a spectrum, of "
                  "which the value at %g nm is taken",
                  SODIUM_NM);
    }
}

std::optional<double> transparent_index(const Properties &props) {
    const std::string transmission = props.get<std::string>("transmission", "none");
    // Rust refuses values other than these and "none".
    if (transmission != "film" && transmission != "interface")
        return {};
    for (const char *name : { "material", "k", "diffuse_reflectance" })
        if (props.has_property(name))
            Throw("parameter \"%s\" contradicts transmission \"%s\": the body is a clear dielectric; leave it out",
                  name, transmission);
    if (transmission == "interface" && props.has_property("back_reflection"))
        Throw("parameter \"back_reflection\" contradicts transmission \"interface\": only a film has a back");
    if (props.has_property("eta")) {
        for (const char *name : { "int_ior", "ext_ior" })
            if (props.has_property(name))
                Throw("parameter \"%s\" contradicts \"eta\": give either \"eta\" or both media", name);
        if (!is_number(props, "eta"))
            Throw("parameter \"eta\" must be a float, one number for the whole surface, where light is transmitted");
        return props.get<double>("eta");
    }
    const double inner = medium_index(props, "int_ior", "bk7"), outer = medium_index(props, "ext_ior", "air");
    // The medium above must be air, because the tables' wavelengths are those in air. The negated comparison also
    // refuses NaN.
    if (!(std::abs(outer - 1.0) <= AIR_TOLERANCE))
        Throw("parameter \"ext_ior\" is %.9g, but must be that of air or vacuum", outer);
    return inner / outer;
}

std::string material_name(const Properties &props) {
    const std::string material = props.get<std::string>("material", "none");
    const bool has_eta = props.has_property("eta"), has_k = props.has_property("k");
    if (material != "none" && (has_eta || has_k))
        Throw("parameter \"material\" contradicts \"%s\": give either a material or eta and k", has_eta ? "eta" : "k");
    if (has_k && !has_eta)
        Throw("parameter \"k\" needs \"eta\": give both, or \"eta\" alone for a dielectric");
    if (material == "none")
        return material;
    // A name with a slash could lead to a file elsewhere.
    const auto file = mitsuba::file_resolver()->resolve(mitsuba::fs::path("data/ior/" + material + ".eta.spd"));
    if (material.find('/') != material.npos || !mitsuba::fs::is_regular_file(file))
        Throw("parameter \"material\" is \"%s\", but must be one of %s", material, known_materials());
    return material;
}

IndexSpectrum index_spectrum(const Properties &props, const std::string &material) {
    IndexSpectrum index;
    if (material != "none") {
        auto read_file = [&](const char *suffix, std::vector<double> &nm, std::vector<double> &values) {
            const auto file = mitsuba::file_resolver()->resolve(mitsuba::fs::path("data/ior/" + material + suffix));
            mitsuba::spectrum_from_file<double>(file, nm, values);
        };
        read_file(".eta.spd", index.eta_nm, index.eta);
        read_file(".k.spd", index.k_nm, index.k);
        return index;
    }
    // Without a material and eta, the empty index stands for a perfect reflector.
    if (!props.has_property("eta"))
        return index;
    // Reads eta or k; a constant has no wavelengths. Returns false for a colour or a texture.
    auto read_parameter = [&](const char *name, std::vector<double> &nm, std::vector<double> &values) {
        switch (props.type(name)) {
            case Properties::Type::Float:
            case Properties::Type::Integer:
                values = { props.get<double>(name) };
                return true;
            case Properties::Type::Spectrum: {
                const auto &spectrum = props.get<Properties::Spectrum>(name);
                nm                   = spectrum.wavelengths;
                values               = spectrum.values;
                return true;
            }
            default:
                return false;
        }
    };
    index.is_known = read_parameter("eta", index.eta_nm, index.eta);
    if (!props.has_property("k"))
        index.k = { 0.0 };
    else if (!read_parameter("k", index.k_nm, index.k))
        index.is_known = false;
    return index;
}

WavelengthRange range_of(const std::vector<double> &nm) {
    WavelengthRange range;
    if (!nm.empty()) {
        range.low  = std::max(range.low, nm.front());
        range.high = std::min(range.high, nm.back());
    }
    return range;
}

void check_coverage(const std::string &source, const WavelengthRange &range) {
    if (range.is_complete())
        return;
    if (range.low > range.high)
        Throw("%s: no wavelength from %g to %g nm has a value", source, MI_CIE_MIN, MI_CIE_MAX);
    Log(mitsuba::Warn,
        "%s is given from %g to %g nm only: the values at its ends are taken for the rest of %g to %g nm", source,
        range.low, range.high, MI_CIE_MIN, MI_CIE_MAX);
}

Properties::Spectrum continued(std::vector<double> nm, std::vector<double> values) {
    if (nm.front() > MI_CIE_MIN) {
        nm.insert(nm.begin(), MI_CIE_MIN);
        values.insert(values.begin(), values.front());
    }
    if (nm.back() < MI_CIE_MAX) {
        nm.push_back(MI_CIE_MAX);
        values.push_back(values.back());
    }
    return Properties::Spectrum(std::move(nm), std::move(values));
}

void check_optics(const Properties &props) {
    const double infinity = std::numeric_limits<double>::infinity();
    check_range(props, "eta", 0, infinity, "a finite number of at least 0");
    check_range(props, "k", 0, infinity, "a finite number of at least 0");
    check_range(props, "specular_reflectance", 0, 1, "in [0, 1]");
    // Without transmission `specular_transmittance` stays unread, and `refuse_unknown` refuses it.
    if (props.get<std::string>("transmission", "none") != "none")
        check_range(props, "specular_transmittance", 0, 1, "in [0, 1]");
    check_range(props, "diffuse_reflectance", 0, 1, "in [0, 1]");
    if (props.has_property("cover_reflection") && !props.has_property("cover_eta"))
        Throw("parameter \"cover_reflection\" contradicts the absence of \"cover_eta\": it is about a cover");
    check_range(props, "rotation", -infinity, infinity, "a finite angle in degrees");
}

void refuse_unknown(const Properties &props) {
    for (const std::string &name : props.unqueried()) {
        for (const char *transmission_only : TRANSMISSION_ONLY)
            if (name == transmission_only)
                Throw("unknown parameter \"%s\" without transmission \"film\" or \"interface\"", name);
        Throw("unknown parameter \"%s\"; the plugin \"diffraction\" accepts %s", name, ALL_NAMES);
    }
}

} // namespace sunbeam
