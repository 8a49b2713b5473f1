// Constant extrapolation of the spectra of the refractive index eta + ik beyond their ends, with a warning. Mitsuba
// would return zero there, and an index of zero would reflect everything.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <drjit/traversable_base.h>
#include <mitsuba/core/properties.h>
#include <mitsuba/core/spectrum.h>
#include <mitsuba/render/interaction.h>
#include <mitsuba/render/texture.h>

#include "compat.h"
#include "parameters.h"

namespace sunbeam {

namespace dr = drjit;

/// Range of wavelengths in nm for which a texture and all textures nested in it have values.
///
/// Nested textures are found by `Texture::traverse`, which calls `put_object` for each of them.
template <typename Texture> class SpectralRange final : public mitsuba::TraversalCallback {
public:
    explicit SpectralRange(Texture &texture) { add(texture); }

    /// Range in nm for which all these textures have values, cut to Mitsuba's range of 360 to 830 nm.
    WavelengthRange range;

private:
    /// Intersects the range with that of a texture and of the textures nested in it.
    void add(Texture &texture) {
        const auto given = texture.wavelength_range();
        range.low        = std::max(range.low, (double) given.x());
        range.high       = std::min(range.high, (double) given.y());
        texture.traverse(this);
    }

    void put_value(std::string_view, void *, uint32_t, const std::type_info &) override {}
    void put_object(std::string_view, mitsuba::Object *object, uint32_t) override {
        if (object && object->type() == mitsuba::ObjectType::Texture)
            add(*static_cast<Texture *>(object));
    }
};

/// Evaluates the texture of eta or k with constant extrapolation. Spectral variants clip the wavelengths to the
/// texture's range. RGB and mono variants evaluate without wavelengths, so `initialise` replaces the texture by an
/// extended one.
template <typename Float, typename Spectrum> class SpectralEnds {
public:
    using Texture             = mitsuba::Texture<Float, Spectrum>;
    using UnpolarizedSpectrum = mitsuba::unpolarized_spectrum_t<Spectrum>;
    using SurfaceInteraction  = mitsuba::SurfaceInteraction<Float, Spectrum>;

    /// Reads the range of a texture. In RGB and mono variants, replaces the texture if its spectrum does not cover
    /// Mitsuba's whole range.
    ///
    /// For a texture made of a spectrum, `nm` has the rising wavelengths and `values` the spectrum's values. Otherwise
    /// both are empty, and an RGB or mono variant keeps the texture. `source` names the texture in warnings and errors.
    /// Throws if no wavelength has a value.
    void initialise(mitsuba::ref<Texture> &texture, const std::string &source, const std::vector<double> &nm,
                    const std::vector<double> &values) {
        m_source = source;
        if constexpr (mitsuba::is_spectral_v<Spectrum>) {
            update(*texture);
        } else if (const WavelengthRange range = range_of(nm); !range.is_complete()) {
            check_coverage(source, range);
            mitsuba::Properties props;
            props.set("spectrum", continued(nm, values));
            // Unbounded: eta and k may exceed 1, unlike a reflectance.
            texture = props.get_unbounded_texture<Texture>("spectrum");
        }
    }

    /// Reads the range of the texture again, in spectral variants. If it has changed and is not complete, warns or
    /// throws as `initialise` does.
    void update(Texture &texture) {
        if constexpr (mitsuba::is_spectral_v<Spectrum>) {
            const WavelengthRange range = SpectralRange<Texture>(texture).range;
            if (range == m_range)
                return;
            check_coverage(m_source, range);
            m_range = range;
            // Opaque variables are inputs of the kernel, not literals in it, so one kernel serves every range.
            m_low  = dr::opaque<Float>((dr::scalar_t<Float>) range.low);
            m_high = dr::opaque<Float>((dr::scalar_t<Float>) range.high);
        }
    }

    /// Whether `eval` clips wavelengths. A range that covers all of Mitsuba's wavelengths needs no clipping.
    bool are_clipped() const { return mitsuba::is_spectral_v<Spectrum> && !m_range.is_complete(); }

    /// Reports the ends to Dr.Jit as inputs of a frozen function (`dr.freeze`), which records kernels and replays them.
    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro fn) const {
        if constexpr (dr::is_jit_v<Float>)
            for (const Float *end : { &m_low, &m_high })
                fn(payload, end->index_combined(), "", "");
    }
    /// Reports the ends and ignores the replacements that `fn` returns: kernels never write them.
    void traverse_1_cb_rw(void *payload, dr::detail::traverse_callback_rw fn) const {
        if constexpr (dr::is_jit_v<Float>)
            for (const Float *end : { &m_low, &m_high })
                fn(payload, end->index_combined(), "", "");
    }

    /// Value of the texture at the point and the clipped wavelengths of `si`: eta or k, which have no unit.
    UnpolarizedSpectrum eval(const Texture &texture, const SurfaceInteraction &si, dr::mask_t<Float> active) const {
        if constexpr (mitsuba::is_spectral_v<Spectrum>) {
            if (are_clipped()) {
                SurfaceInteraction inside = si;
                inside.wavelengths        = dr::clip(si.wavelengths, m_low, m_high);
                return texture.eval(inside, active);
            }
        }
        return texture.eval(si, active);
    }

private:
    /// Name of the texture in warnings and errors.
    std::string m_source;
    /// Range of the texture when it was last read. RGB and mono variants leave it complete.
    WavelengthRange m_range;
    /// Ends of the range in nm as variables, for clipping. Not read while the range is complete.
    Float m_low = 0.f, m_high = 0.f;
};

} // namespace sunbeam
