// How the proposal's weight is shared among the cells of leaves, as Dr.Jit arrays: the twin of
// `src/reflectance/cell_shares.rs`, which says what it is. Names are the same there and here.
#pragma once

#include <array>
#include <tuple>
#include <vector>

#include "tables.h"

namespace sunbeam {

template <typename Float> class CellShares {
public:
    using LobeTables                = Tables<Float>;
    using UInt32                    = typename LobeTables::UInt32;
    using UInt32X                   = typename LobeTables::UInt32X;
    using Mask                      = typename LobeTables::Mask;
    using Vector3f                  = typename LobeTables::Vector3f;
    using Point2f                   = typename LobeTables::Point2f;
    template <size_t N> using Wide  = dr::Array<Float, N>;
    template <size_t N> using WideU = dr::Array<UInt32, N>;
    using Index                     = dr::Array<UInt32, 4>;

    static constexpr size_t CORNERS = 8;
    static constexpr size_t MET_MAX = LobeTables::LEAVES_MET_MAX;

    /// The grid's nodes about an incidence at N wavelengths: where their shares are, and their weights.
    template <size_t N> struct Corners {
        std::array<std::array<Index, N>, CORNERS> windows;
        std::array<Wide<N>, CORNERS> weights;
    };

    explicit CellShares(const Surface &surface) : m_layout(surface.layout()) {
        if (!present())
            return;
        m_index = dr::load<UInt32X>(surface.share_index().data(), surface.share_index().size());
        // Two shares to an integer.
        const auto shares = surface.share_cumulative();
        std::vector<uint32_t> packed((shares.size() + 1) / 2, 0);
        for (size_t i = 0; i < shares.size(); ++i)
            packed[i / 2] |= uint32_t(shares[i]) << (i % 2 * 16);
        m_cumulative = dr::load<UInt32X>(packed.data(), packed.size());
    }

    /// Whether there is more than one cell.
    bool present() const { return m_layout.share_polar > 0; }

    /// The nodes about an incidence.
    template <size_t N> Corners<N> corners(const Vector3f &wi, const Wide<N> &wavelength_nm, const Mask &active) const {
        Corners<N> corners;
        const uint32_t polar = m_layout.share_polar, azimuths = m_layout.share_azimuths,
                       planes = m_layout.share_wavelengths;
        const Float cos       = dr::clip(wi.z(), 0.f, 1.f);
        const Float t         = dr::sqrt(1.f - dr::sqrt(cos)) * float(polar);
        const UInt32 p        = dr::minimum(UInt32(t), polar - 1);
        const Float turn = dr::clip(dr::atan2(wi.y(), wi.x()) * dr::InvTwoPi<Float> + .5f, 0.f, 1.f) * float(azimuths);
        const UInt32 a   = UInt32(turn);
        const double low = m_layout.wavelength_min_nm;
        const float octave = float((planes - 1) / std::log(m_layout.wavelength_max_nm / low));
        const Wide<N> l    = dr::clip(dr::log(wavelength_nm / float(low)) * octave, 0.f, float(planes - 1));
        const WideU<N> il  = dr::minimum(WideU<N>(l), planes - 2);
        auto weight        = [](bool upper, const auto &fraction) { return upper ? fraction : 1.f - fraction; };
        for (uint32_t c = 0; c < CORNERS; ++c) {
            const uint32_t dp = c & 1, da = c >> 1 & 1, dl = c >> 2;
            const UInt32 azimuth = (a + da) % azimuths;
            corners.weights[c] = weight(dl, l - Wide<N>(il)) * (weight(dp, t - Float(p)) * weight(da, turn - Float(a)));
            for (size_t k = 0; k < N; ++k)
                corners.windows[c][k] =
                    dr::gather<Index>(m_index, ((il[k] + dl) * azimuths + azimuth) * (polar + 1) + p + dp, active);
        }
        return corners;
    }

    /// Shares of `count` cells along x.
    template <size_t N> std::array<Wide<N>, MET_MAX> shares(const Corners<N> &corners, const WideU<N> &cell_x,
                                                            const WideU<N> &cell_y, uint32_t count,
                                                            const Mask &active) const {
        std::array<Wide<N>, MET_MAX> result;
        result.fill(Wide<N>(0.f));
        using Int32 = dr::int32_array_t<Float>;
        for (size_t c = 0; c < CORNERS; ++c) {
            for (size_t k = 0; k < N; ++k) {
                const Index &window = corners.windows[c][k];
                const Int32 width(window[3] & 0xffffu), height(window[3] >> 16);
                const Int32 x = Int32(cell_x[k]) - Int32(window[1]), y = Int32(cell_y[k]) - Int32(window[2]);
                const Mask there  = active && y >= 0 && y < height;
                const UInt32 line = window[0] + UInt32(y * width);
                Float last        = cumulative(line + UInt32(dr::clip(x, 0, width)), there);
                for (uint32_t i = 0; i < count; ++i) {
                    const Float next = cumulative(line + UInt32(dr::clip(x + int(i + 1), 0, width)), there);
                    result[i][k]     = dr::fmadd(corners.weights[c][k], next - last, result[i][k]);
                    last             = next;
                }
            }
        }
        return result;
    }

    /// A cell by its share; where nothing is reflected, `active` is left false.
    std::tuple<UInt32, UInt32, Float, Float> choose(const Corners<1> &corners, const Point2f &u, Mask &active) const {
        Index window(0u);
        Float total(0.f), passed(0.f), start(0.f), width(1.f);
        for (size_t c = 0; c < CORNERS; ++c)
            total += corners.weights[c][0];
        const Float target = u.y() * total;
        Mask done(false);
        for (size_t c = 0; c < CORNERS; ++c) {
            const Float weight = corners.weights[c][0];
            const Mask here    = !done && weight > 0.f;
            window             = dr::select(here, corners.windows[c][0], window);
            start              = dr::select(here, passed, start);
            width              = dr::select(here, weight, width);
            passed             = dr::select(here, passed + weight, passed);
            done |= here && target < passed;
        }
        const float last     = dr::OneMinusEpsilon<float>;
        const Float uy       = dr::clip((target - start) / width, 0.f, last);
        const UInt32 columns = window[3] & 0xffffu, size = columns * (window[3] >> 16);
        active &= size > 0;
        const UInt32 cell = dr::binary_search<UInt32>(0, m_layout.share_cells_max, [&](const UInt32 &index) {
            const Mask inside = active && index + 1 < size;
            return inside && cumulative(window[0] + index + 1, inside) <= u.x();
        });
        const Float low = cumulative(window[0] + cell, active), high = cumulative(window[0] + cell + 1, active);
        const UInt32 y     = cell / dr::maximum(columns, 1u);
        const Float inside = dr::select(high > low, dr::clip((u.x() - low) / (high - low), 0.f, last), .5f);
        return { window[1] + cell - y * columns, window[2] + y, inside, uy };
    }

private:
    /// A cumulative share by its index.
    Float cumulative(const UInt32 &index, const Mask &active) const {
        const UInt32 pair = dr::gather<UInt32>(m_cumulative, index >> 1, active);
        return Float(dr::select((index & 1u) == 0u, pair & 0xffffu, pair >> 16)) * float(1.0 / 65535.0);
    }

    Layout m_layout;
    UInt32X m_index, m_cumulative;

public:
    DRJIT_TRAVERSE(CellShares, m_index, m_cumulative)
};

} // namespace sunbeam
