// The tables of a surface as Dr.Jit arrays, and the look-ups in them: the twin of `src/table/` and of
// `src/reflectance/albedo_scale.rs`, which say what the numbers mean. Names are the same there and here.
#pragma once

#include <array>
#include <cmath>
#include <utility>

#include <drjit/util.h>
#include <drjit/while_loop.h>
#include <mitsuba/render/bsdf.h>

#include "sunbeam/src/mitsuba/bridge.rs.h"

namespace sunbeam {

namespace dr = drjit;

/// Look-ups for backends that trace. `N` is the number of wavelengths carried at once.
template <typename Float> class Tables {
public:
    using FloatX                   = mitsuba::DynamicBuffer<Float>;
    using UInt32                   = dr::uint32_array_t<Float>;
    using Int32                    = dr::int32_array_t<Float>;
    using Float64                  = dr::float64_array_t<Float>;
    using UInt32X                  = mitsuba::DynamicBuffer<UInt32>;
    using Mask                     = dr::mask_t<Float>;
    using Vector3f                 = mitsuba::Vector<Float, 3>;
    using Point2f                  = mitsuba::Point<Float, 2>;
    using Packet                   = dr::Array<Float, 4>;
    template <size_t N> using Wide = dr::Array<Float, N>;

    /// κ bands of the proposal, floats before the spline coefficients of a record, and most leaves that a look-up meets
    /// along an axis.
    static constexpr size_t BANDS = 6, HEADER = 8, LEAVES_MET_MAX = 4;

    /// Power density `S(f; κ)` in µm² and the proposal's density over f, for each wavelength.
    template <size_t N> struct Density { Wide<N> value, proposal; };

    /// Where a look-up lies on the lattice: its first node, counted from the lattice's first, and the distance from
    /// there.
    template <size_t N> struct Position {
        dr::Array<UInt32, N> column, row;
        Wide<N> from_x, from_y;
        /// Whether the table knows what is there.
        dr::mask_t<Wide<N>> known;
    };

    /// What the proposal gives the leaves that a look-up meets: the first of them, then for each, row by row, a factor
    /// and a position among the κ bands.
    template <size_t N> struct Window {
        dr::Array<UInt32, N> first_x, first_y;
        std::array<Wide<N>, LEAVES_MET_MAX * LEAVES_MET_MAX> amount, band_at;
    };

    explicit Tables(const Surface &surface) : m_layout(surface.layout()) {
        auto floats = [](auto slice) { return dr::load<FloatX>(slice.data(), slice.size()); };
        m_records   = floats(surface.records());
        m_offsets   = dr::load<UInt32X>(surface.offsets().data(), surface.offsets().size());
        if (m_layout.scale_cosines > 0)
            m_scale_corners = floats(surface.scale_corners());
        m_weights = floats(wavelength_weights());
    }

    const Layout &layout() const { return m_layout; }

    /// Where the direction cosines (x, y), times `further`, lie on the lattice. Positions are taken in double
    /// precision, from wavelengths as they were given: a narrow order is a small part of the distance from the origin.
    template <size_t N> Position<N> position(const Vector3f &wi, const Vector3f &wo,
                                             const dr::Array<Float64, N> &further, const Wide<N> &wavelength_nm) const {
        using Wide64            = dr::Array<Float64, N>;
        const Wide64 wavenumber = 1e3 / Wide64(wavelength_nm);
        const Wide64 px      = dr::fmadd(further, Float64(wo.x()), Float64(wi.x())) * m_layout.period_x_um * wavenumber;
        const Wide64 py      = dr::fmadd(further, Float64(wo.y()), Float64(wi.y())) * m_layout.period_y_um * wavenumber;
        const Wide64 first_x = first_tap(px, m_layout.taps_x, m_layout.reach_x);
        const Wide64 first_y = first_tap(py, m_layout.taps_y, m_layout.reach_y);
        Position<N> position;
        position.column = dr::Array<UInt32, N>(first_x + double(m_layout.reach_x));
        position.row    = dr::Array<UInt32, N>(first_y + double(m_layout.reach_y));
        position.from_x = Wide<N>(px - first_x);
        position.from_y = Wide<N>(py - first_y);
        position.known  = dr::mask_t<Wide<N>>(dr::abs(px) <= m_layout.cutoff_x && dr::abs(py) <= m_layout.cutoff_y);
        return position;
    }

    /// `S(f; κ)` and the proposal's density at a position.
    template <size_t N> Density<N> lookup(const Position<N> &position, const Wide<N> &kappa, const Window<N> &window,
                                          const Mask &active) const {
        using WideF = Wide<N>;
        const Curve<N> curve(*this, dr::minimum(kappa, float(m_layout.kappa_max)));
        WideF re(0.f), im(0.f), proposal(0.f);
        for_taps(
            position, active, "diffraction orders",
            [&](const WideF &e, const dr::Array<UInt32, N> &column, const dr::Array<UInt32, N> &row, WideF &re,
                WideF &im, WideF &proposal) {
                const auto [amount, at] = chosen<N>(window, column, row);
                for (size_t k = 0; k < N; ++k) {
                    const UInt32 record = dr::gather<UInt32>(m_offsets, row[k] * columns() + column[k], active);
                    const Packet head   = dr::gather<Packet>(m_records, record, active),
                                 tail   = dr::gather<Packet>(m_records, record + 1, active);
                    Float power(0.f);
                    for (size_t b = 0; b < BANDS; ++b)
                        power = dr::fmadd(dr::maximum(1.f - dr::abs(at[k] - float(b)), 0.f),
                                          b < 4 ? head[b] : tail[b - 4], power);
                    power *= amount[k];
                    if (m_layout.amplitude) {
                        const auto [a, b] = curve.amplitude(k, record, active);
                        re[k]             = dr::fmadd(e[k], tail[2] + a, re[k]);
                        im[k]             = dr::fmadd(e[k], tail[3] + b, im[k]);
                        proposal[k]       = dr::fmadd(e[k] * e[k], power, proposal[k]);
                    } else {
                        const Float at_zero = dr::fmadd(curve.linear[k], tail[3], tail[2]);
                        re[k]               = dr::fmadd(e[k], at_zero + curve.power(k, record, active), re[k]);
                        proposal[k]         = dr::fmadd(e[k], power, proposal[k]);
                    }
                }
            },
            re, im, proposal);
        WideF value = m_layout.amplitude ? dr::fmadd(re, re, im * im) : dr::maximum(re, 0.f);
        if (std::isfinite(m_layout.cutoff_x) || std::isfinite(m_layout.cutoff_y))
            value &= position.known;
        return { value * float(m_layout.norm), proposal * float(m_layout.proposal_norm) };
    }

    /// The proposal's density alone.
    template <size_t N>
    Wide<N> proposal(const Position<N> &position, const Window<N> &window, const Mask &active) const {
        using WideF = Wide<N>;
        WideF re(0.f), im(0.f), proposal(0.f);
        for_taps(
            position, active, "folded orders",
            [&](const WideF &e, const dr::Array<UInt32, N> &column, const dr::Array<UInt32, N> &row, WideF &, WideF &,
                WideF &proposal) {
                const auto [amount, at] = chosen<N>(window, column, row);
                for (size_t k = 0; k < N; ++k) {
                    const Float power = amount[k] * node_power(row[k] * columns() + column[k], at[k], active);
                    proposal[k]       = dr::fmadd(m_layout.amplitude ? e[k] * e[k] : e[k], power, proposal[k]);
                }
            },
            re, im, proposal);
        return proposal * float(m_layout.proposal_norm);
    }

    /// Power of a node, given by its row-major number, at a position among the κ bands.
    Float node_power(const UInt32 &node, const Float &band_at, const Mask &active) const {
        const UInt32 record = dr::gather<UInt32>(m_offsets, node, active) * 4;
        const UInt32 band   = dr::minimum(UInt32(band_at), uint32_t(BANDS) - 2);
        return dr::lerp(dr::gather<Float>(m_records, record + band, active),
                        dr::gather<Float>(m_records, record + band + 1, active), band_at - Float(band));
    }

    /// The energy scaling of one direction at each wavelength.
    template <size_t N> Wide<N> scale(const Vector3f &w, const Wide<N> &wavelength_um, const Mask &active) const {
        if (m_layout.scale_cosines == 0)
            return 1.f;
        const uint32_t cosines = m_layout.scale_cosines, azimuths = m_layout.scale_azimuths,
                       wavelengths = m_layout.scale_wavelengths;
        const Float cos            = dr::clip(w.z(), 0.f, 1.f);
        const UInt32 i             = dr::minimum(UInt32(dr::sqrt(cos) * float(cosines)), cosines - 1);
        const Float at = dr::square(Float(i) / float(cosines)), next = dr::square(Float(i + 1) / float(cosines));
        const Float fc    = dr::clip((cos - at) / (next - at), 0.f, 1.f);
        const Float turn  = dr::clip(dr::atan2(w.y(), w.x()) * dr::InvTwoPi<Float> + .5f, 0.f, 1.f) * float(azimuths);
        const UInt32 a    = UInt32(turn);
        const Float fa    = turn - Float(a);
        const UInt32 cell = dr::select(a >= azimuths, a - azimuths, a) * cosines + i;
        Wide<N> result;
        for (size_t k = 0; k < N; ++k) {
            const float span  = float(m_layout.wavelength_max_nm - m_layout.wavelength_min_nm);
            const Float l     = dr::clip((wavelength_um[k] * 1e3f - float(m_layout.wavelength_min_nm)) *
                                             (float(wavelengths - 1) / span),
                                         0.f, float(wavelengths - 1));
            const UInt32 il   = dr::minimum(UInt32(l), wavelengths - 2);
            const UInt32 at_l = il * (azimuths * cosines) + cell;
            const Packet p0   = dr::gather<Packet>(m_scale_corners, at_l, active),
                         p1   = dr::gather<Packet>(m_scale_corners, at_l + azimuths * cosines, active);
            const Packet p    = dr::lerp(p0, p1, l - Float(il));
            result[k]         = dr::lerp(dr::lerp(p[0], p[1], fc), dr::lerp(p[2], p[3], fc), fa);
        }
        return result;
    }

    /// Red, green, blue and luminance weight per nm.
    Packet wavelength_weight(const Float &wavelength_nm, const Mask &active) const {
        const uint32_t count = uint32_t(m_layout.wavelength_max_nm - m_layout.wavelength_min_nm) + 1;
        const Float t        = dr::clip(wavelength_nm - float(m_layout.wavelength_min_nm), 0.f, float(count - 1));
        const UInt32 i       = dr::minimum(UInt32(t), count - 2);
        return dr::lerp(dr::gather<Packet>(m_weights, i, active), dr::gather<Packet>(m_weights, i + 1, active),
                        t - Float(i));
    }

private:
    uint32_t columns() const { return 2 * m_layout.reach_x + 1; }

    /// Visits the nodes about a position; `visit` adds to the three sums.
    template <size_t N, typename Visit> void for_taps(const Position<N> &position, const Mask &active, const char *name,
                                                      Visit visit, Wide<N> &re, Wide<N> &im, Wide<N> &proposal) const {
        using WideF        = Wide<N>;
        const float log2_e = 1.44269504f;
        const float ax     = float(-0.5 * log2_e / (m_layout.sigma_x * m_layout.sigma_x));
        const float ay     = float(-0.5 * log2_e / (m_layout.sigma_y * m_layout.sigma_y));
        auto tap           = [&](const UInt32 &ix, const UInt32 &iy, WideF &re, WideF &im, WideF &proposal) {
            const WideF dx = position.from_x - Float(ix), dy = position.from_y - Float(iy);
            const WideF e = dr::exp2(dr::fmadd(dx * dx, ax, dy * dy * ay));
            visit(e, position.column + ix, position.row + iy, re, im, proposal);
        };
        const uint32_t taps = m_layout.taps_x * m_layout.taps_y, taps_x = m_layout.taps_x;
        if (taps == 1) {
            tap(UInt32(0), UInt32(0), re, im, proposal);
            return;
        }
        UInt32 i(0);
        dr::tie(i, re, im, proposal) = dr::while_loop(
            dr::make_tuple(i, re, im, proposal),
            [taps, active](const UInt32 &i, const WideF &, const WideF &, const WideF &) { return active && i < taps; },
            [&tap, taps_x](UInt32 &i, WideF &re, WideF &im, WideF &proposal) {
                const UInt32 iy = i / taps_x;
                tap(i - iy * taps_x, iy, re, im, proposal);
                i += 1;
            },
            name);
    }

    /// What a window gives the leaf of a node.
    template <size_t N> std::pair<Wide<N>, Wide<N>> chosen(const Window<N> &window, const dr::Array<UInt32, N> &column,
                                                           const dr::Array<UInt32, N> &row) const {
        const uint32_t mx = m_layout.leaf_met_x, my = m_layout.leaf_met_y;
        Wide<N> amount = window.amount[0], at = window.band_at[0];
        const auto x = (column >> m_layout.leaf_shift_x) - window.first_x,
                   y = (row >> m_layout.leaf_shift_y) - window.first_y;
        for (uint32_t i = 1; i < mx * my; ++i) {
            const auto here = x == i % mx && y == i / mx;
            amount          = dr::select(here, window.amount[i], amount);
            at              = dr::select(here, window.band_at[i], at);
        }
        return { amount, at };
    }

    /// First node that a look-up reads along an axis: the nearest ones that there are.
    template <typename Wide64> static Wide64 first_tap(const Wide64 &position, uint32_t taps, uint32_t reach) {
        return dr::clip(dr::ceil(position - 0.5 * taps), -double(reach), double(reach) + 1.0 - double(taps));
    }

    /// Where a look-up reads the splines in κ: two packets of four coefficients, of which four count.
    template <size_t N> struct Curve {
        const Tables &tables;
        dr::Array<UInt32, N> first; // in packets, real records
        dr::Array<Wide<N>, 8> weights;
        Wide<N> factor_re, factor_im, linear;

        Curve(const Tables &tables, const Wide<N> &kappa) : tables(tables) {
            const Wide<N> t      = kappa / float(tables.m_layout.kappa_step);
            first                = dr::Array<UInt32, N>(t) >> 2;
            const Wide<N> offset = t - Wide<N>(first << 2) + 1.f;
            for (size_t s = 0; s < 8; ++s)
                weights[s] = cubic(offset - float(s));
            const float knee      = float(tables.m_layout.kappa_knee);
            const Wide<N> squares = dr::fmadd(kappa, kappa, knee * knee);
            factor_re             = kappa * kappa / squares;
            factor_im             = -knee * kappa / squares;
            linear                = knee * knee * kappa / squares;
        }

        static Wide<N> cubic(const Wide<N> &distance) {
            const Wide<N> d = dr::abs(distance), rest = dr::maximum(2.f - d, 0.f);
            return dr::select(d < 1.f, 2.f / 3.f - d * d * dr::fmadd(d, -.5f, 1.f), rest * rest * rest * (1.f / 6.f));
        }

        Float power(size_t k, const UInt32 &record, const Mask &active) const {
            Float sum(0.f);
            for (uint32_t p = 0; p < 2; ++p) {
                const Packet c =
                    dr::gather<Packet>(tables.m_records, record + (first[k] + uint32_t(HEADER / 4) + p), active);
                for (size_t s = 0; s < 4; ++s)
                    sum = dr::fmadd(weights[4 * p + s][k], c[s], sum);
            }
            return factor_re[k] * sum;
        }

        std::pair<Float, Float> amplitude(size_t k, const UInt32 &record, const Mask &active) const {
            Float re(0.f), im(0.f);
            for (uint32_t p = 0; p < 4; ++p) {
                const Packet c =
                    dr::gather<Packet>(tables.m_records, record + (first[k] * 2 + uint32_t(HEADER / 4) + p), active);
                for (size_t s = 0; s < 2; ++s) {
                    re = dr::fmadd(weights[2 * p + s][k], c[2 * s], re);
                    im = dr::fmadd(weights[2 * p + s][k], c[2 * s + 1], im);
                }
            }
            return { dr::fmsub(factor_re[k], re, factor_im[k] * im), dr::fmadd(factor_re[k], im, factor_im[k] * re) };
        }
    };

    Layout m_layout;
    FloatX m_records, m_scale_corners, m_weights;
    UInt32X m_offsets;

public:
    DRJIT_TRAVERSE(Tables, m_records, m_scale_corners, m_weights, m_offsets)
};

} // namespace sunbeam
