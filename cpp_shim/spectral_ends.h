// Continuation of eta and k beyond the ends of their spectra. Mitsuba returns zero there, and an index of zero would
// reflect everything. Here the end values continue, and a warning says so.
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

/// Wavelengths in nm common to all spectra of a texture and of the textures nested in it.
template <typename Texture> class SpectralRange final : public mitsuba::TraversalCallback {
public:
    explicit SpectralRange(Texture &texture) { add(texture); }

    WavelengthRange range;

private:
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

/// Evaluates a texture of eta or k with wavelengths clipped to the texture's range.
template <typename Float, typename Spectrum> class SpectralEnds {
public:
    using Texture             = mitsuba::Texture<Float, Spectrum>;
    using UnpolarizedSpectrum = mitsuba::unpolarized_spectrum_t<Spectrum>;
    using SurfaceInteraction  = mitsuba::SurfaceInteraction<Float, Spectrum>;

    /// Sets up a texture made of samples at rising wavelengths in nm; no samples if it was made of something else.
    /// RGB and mono variants replace the texture of a spectrum that ends early. `source` names the texture in warnings
    /// and errors.
    void begin(mitsuba::ref<Texture> &texture, const std::string &source, const std::vector<double> &nm,
               const std::vector<double> &values) {
        m_source = source;
        if constexpr (mitsuba::is_spectral_v<Spectrum>) {
            update(*texture);
        } else if (const WavelengthRange range = range_of(nm); !range.is_complete()) {
            tell_ends(source, range);
            mitsuba::Properties props;
            props.set("spectrum", continued(nm, values));
            texture = props.get_unbounded_texture<Texture>("spectrum");
        }
    }

    /// Reads the present range of the texture and warns if it is new.
    void update(Texture &texture) {
        if constexpr (mitsuba::is_spectral_v<Spectrum>) {
            const WavelengthRange range = SpectralRange<Texture>(texture).range;
            if (range == m_range)
                return;
            tell_ends(m_source, range);
            m_range = range;
            // Opaque: the ends are inputs of the kernel, so one kernel serves every range.
            m_low  = dr::opaque<Float>((dr::scalar_t<Float>) range.low);
            m_high = dr::opaque<Float>((dr::scalar_t<Float>) range.high);
        }
    }

    /// Whether wavelengths are clipped. A complete range traces no clipping.
    bool are_clipped() const { return mitsuba::is_spectral_v<Spectrum> && !m_range.is_complete(); }

    /// Shows frozen functions the ends, which are their inputs.
    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro fn) const {
        if constexpr (dr::is_jit_v<Float>)
            for (const Float *end : { &m_low, &m_high })
                fn(payload, end->index_combined(), "", "");
    }
    /// Ignores what comes back: the ends are never written by a kernel.
    void traverse_1_cb_rw(void *payload, dr::detail::traverse_callback_rw fn) const {
        if constexpr (dr::is_jit_v<Float>)
            for (const Float *end : { &m_low, &m_high })
                fn(payload, end->index_combined(), "", "");
    }

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
    std::string m_source;
    WavelengthRange m_range;
    Float m_low = 0.f, m_high = 0.f;
};

} // namespace sunbeam
