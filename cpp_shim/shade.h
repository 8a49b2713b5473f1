// The coarse energy scaling that the proposal heeds, as Dr.Jit arrays: the twin of `src/reflectance/shade.rs`, which
// says what it is. Names are the same there and here.
#pragma once

#include "tables.h"

namespace sunbeam {

template <typename Float> class Shade {
public:
    using LobeTables                = Tables<Float>;
    using FloatX                    = typename LobeTables::FloatX;
    using UInt32                    = typename LobeTables::UInt32;
    using Mask                      = typename LobeTables::Mask;
    template <size_t N> using Wide  = dr::Array<Float, N>;
    template <size_t N> using WideU = dr::Array<UInt32, N>;

    explicit Shade(const Surface &surface) : m_layout(surface.layout()) {
        if (present())
            m_values = dr::load<FloatX>(surface.shade().data(), surface.shade().size());
    }

    /// Whether energy is scaled.
    bool present() const { return m_layout.shade_azimuths > 0; }

    /// The factor towards (x, y), whose cosine is `cos`.
    template <size_t N>
    Wide<N> factor(const Wide<N> &x, const Wide<N> &y, const Wide<N> &cos, const Mask &active) const {
        const uint32_t azimuths = m_layout.shade_azimuths, cosines = m_layout.shade_cosines;
        const Wide<N> along   = dr::abs(y) / dr::maximum(dr::abs(x) + dr::abs(y), 1e-30f);
        const Wide<N> diamond = dr::select(y >= 0.f, dr::select(x >= 0.f, along, 2.f - along),
                                           dr::select(x >= 0.f, 4.f - along, 2.f + along));
        WideU<N> azimuth      = WideU<N>(dr::fmadd(diamond, float(azimuths) / 4.f, .5f));
        azimuth               = dr::select(azimuth >= azimuths, azimuth - azimuths, azimuth);
        const WideU<N> i      = dr::minimum(WideU<N>(dr::sqrt(cos) * float(cosines)), cosines - 1);
        const Wide<N> low = dr::square(Wide<N>(i) / float(cosines)), high = dr::square(Wide<N>(i + 1) / float(cosines));
        const WideU<N> at = azimuth * (cosines + 1) + i;
        const Wide<N> t   = dr::clip((cos - low) / (high - low), 0.f, 1.f);
        Wide<N> value;
        for (size_t k = 0; k < N; ++k)
            value[k] = dr::lerp(dr::gather<Float>(m_values, at[k], active),
                                dr::gather<Float>(m_values, at[k] + 1, active), t[k]);
        return value;
    }

private:
    Layout m_layout;
    FloatX m_values;

public:
    DRJIT_TRAVERSE(Shade, m_values)
};

} // namespace sunbeam
