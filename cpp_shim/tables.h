// The tables of a surface as Dr.Jit arrays, and the look-ups in them: the twin of `src/table/` and of
// `src/reflectance/albedo_scale.rs`, which say what the numbers mean. Names are the same there and here.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include <drjit/util.h>
#include <drjit/while_loop.h>
#include <mitsuba/render/bsdf.h>

#include "sunbeam/src/mitsuba_plugin.rs.h"

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

    /// κ bands of the proposal and floats before the spline coefficients of a record.
    static constexpr size_t BANDS = 6, HEADER = 8;

    /// Power density `S(f; κ)` in µm² and the proposal's density over f, for each wavelength.
    template <size_t N> struct Density { Wide<N> value, proposal; };

    explicit Tables(const Surface &surface) : m_layout(surface.layout()) {
        auto floats = [](auto slice) { return dr::load<FloatX>(slice.data(), slice.size()); };
        m_records   = floats(surface.records());
        m_row_cdf   = floats(surface.row_cdf());
        m_block_cdf = floats(surface.block_cdf());
        m_offsets   = dr::load<UInt32X>(surface.offsets().data(), surface.offsets().size());
        if (m_layout.scale_cosines > 0)
            m_scale_corners = floats(surface.scale_corners());
        m_weights = floats(wavelength_weights());
    }

    const Layout &layout() const { return m_layout; }

    /// Weight of each κ band for outgoing directions over the whole hemisphere.
    template <size_t N> dr::Array<Wide<N>, BANDS> band_weights(const Float &cos_i, const Wide<N> &wavelength_um) const {
        const Wide<N> unit = dr::TwoPi<Float> * float(BANDS / m_layout.kappa_max) / wavelength_um;
        const Wide<N> low = cos_i * unit, high = low + unit;
        dr::Array<Wide<N>, BANDS> weights;
        for (size_t b = 0; b < BANDS; ++b) {
            const Wide<N> top = b + 1 == BANDS ? high : dr::minimum(high, float(b + 1));
            weights[b]        = dr::maximum(top - dr::maximum(low, float(b)), 0.f) / unit;
        }
        return weights;
    }

    /// `S(f; κ)` and the proposal's density. Positions on the lattice are taken in double precision, from wavelengths
    /// as they were given: a narrow order is a small part of the distance from the origin.
    template <size_t N>
    Density<N> lookup(const Vector3f &wi, const Vector3f &wo, const Wide<N> &wavelength_nm, const Mask &active) const {
        using Wide64 = dr::Array<Float64, N>;
        using WideI  = dr::Array<Int32, N>;
        using WideF  = Wide<N>;

        const WideF wavelength_um = wavelength_nm * 1e-3f;
        const Wide64 wavenumber   = 1e3 / Wide64(wavelength_nm);
        const Wide64 px           = (Float64(wi.x()) + Float64(wo.x())) * m_layout.period_x_um * wavenumber;
        const Wide64 py           = (Float64(wi.y()) + Float64(wo.y())) * m_layout.period_y_um * wavenumber;
        const Wide64 first_x      = first_tap(px, m_layout.taps_x, m_layout.reach_x);
        const Wide64 first_y      = first_tap(py, m_layout.taps_y, m_layout.reach_y);
        const WideF from_x(px - first_x), from_y(py - first_y);
        const WideI jx0(first_x), jy0(first_y);

        const WideF kappa =
            dr::minimum(dr::TwoPi<Float> * (wi.z() + wo.z()) / wavelength_um, float(m_layout.kappa_max));
        const Curve<N> curve(*this, kappa);
        const auto bands = band_weights<N>(wi.z(), wavelength_um);

        const float log2_e = 1.44269504f;
        const float ax     = float(-0.5 * log2_e / (m_layout.sigma_x * m_layout.sigma_x));
        const float ay     = float(-0.5 * log2_e / (m_layout.sigma_y * m_layout.sigma_y));
        const int reach_x = int(m_layout.reach_x), reach_y = int(m_layout.reach_y);
        const int columns = 2 * reach_x + 1;

        auto tap = [&](const UInt32 &ix, const UInt32 &iy, WideF &re, WideF &im, WideF &proposal) {
            const WideF dx = from_x - Float(ix), dy = from_y - Float(iy);
            const WideF e  = dr::exp2(dr::fmadd(dx * dx, ax, dy * dy * ay));
            const WideI jx = jx0 + Int32(ix), jy = jy0 + Int32(iy);
            for (size_t k = 0; k < N; ++k) {
                const UInt32 node((jy[k] + reach_y) * columns + jx[k] + reach_x);
                const UInt32 record = dr::gather<UInt32>(m_offsets, node, active);
                const Packet head   = dr::gather<Packet>(m_records, record, active),
                             tail   = dr::gather<Packet>(m_records, record + 1, active);
                Float power         = bands[0][k] * head[0];
                for (size_t b = 1; b < BANDS; ++b)
                    power = dr::fmadd(bands[b][k], b < 4 ? head[b] : tail[b - 4], power);
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
        };

        WideF re(0.f), im(0.f), proposal(0.f);
        const uint32_t taps = m_layout.taps_x * m_layout.taps_y;
        if (taps == 1) {
            tap(UInt32(0), UInt32(0), re, im, proposal);
        } else {
            UInt32 i(0);
            const uint32_t taps_x        = m_layout.taps_x;
            dr::tie(i, re, im, proposal) = dr::while_loop(
                dr::make_tuple(i, re, im, proposal),
                [taps, active](const UInt32 &i, const WideF &, const WideF &, const WideF &) {
                    return active && i < taps;
                },
                [&tap, taps_x](UInt32 &i, WideF &re, WideF &im, WideF &proposal) {
                    const UInt32 iy = i / taps_x;
                    tap(i - iy * taps_x, iy, re, im, proposal);
                    i += 1;
                },
                "diffraction orders");
        }
        WideF value = m_layout.amplitude ? dr::fmadd(re, re, im * im) : dr::maximum(re, 0.f);
        if (std::isfinite(m_layout.cutoff_x))
            value &= dr::abs(px) <= m_layout.cutoff_x;
        if (std::isfinite(m_layout.cutoff_y))
            value &= dr::abs(py) <= m_layout.cutoff_y;
        return { value * float(m_layout.norm), proposal * float(m_layout.proposal_norm) };
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
        const Float fc    = (cos - at) / (next - at);
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

    /// A direction by the orders of one wavelength, with zero for what lies beyond the horizon.
    Vector3f sample_order(const Vector3f &wi, const Float &wavelength_um, const Point2f &u, const Mask &active) const {
        // The band; u.x is stretched over it.
        const auto weights = band_weights<1>(wi.z(), Wide<1>(wavelength_um));
        UInt32 band(BANDS - 1);
        Float low(0.f), sum(0.f), width(1.f);
        Mask found(false);
        for (size_t b = 0; b < BANDS; ++b) {
            const Float next = sum + weights[b][0];
            const Mask here  = !found && u.x() < next;
            band             = dr::select(here, UInt32(b), band);
            low              = dr::select(here, sum, low);
            width            = dr::select(here, weights[b][0], width);
            found |= here;
            // Where rounding keeps the sum below u.x, the last band of any weight is taken.
            const Mask spare = !found && weights[b][0] > 0.f;
            band             = dr::select(spare, UInt32(b), band);
            low              = dr::select(spare, sum, low);
            width            = dr::select(spare, weights[b][0], width);
            sum              = next;
        }
        const float last = dr::OneMinusEpsilon<float>;
        Float ux         = dr::clip((u.x() - low) / width, 0.f, last);

        const uint32_t rows = m_layout.sampler_rows, blocks = m_layout.sampler_blocks,
                       block_len = m_layout.sampler_block_len, columns = 2 * m_layout.reach_x + 1;
        auto [row, uy] = descend(m_row_cdf, band * (rows + 1), rows, u.y(), active);
        UInt32 block;
        std::tie(block, ux) = descend(m_block_cdf, (band * rows + row) * (blocks + 1), blocks, ux, active);

        // The node within its block.
        std::vector<Float> powers(block_len);
        Float total(0.f);
        for (uint32_t k = 0; k < block_len; ++k) {
            const UInt32 column = block * block_len + k;
            const Mask inside   = active && column < columns;
            const UInt32 record = dr::gather<UInt32>(m_offsets, row * columns + column, inside);
            powers[k]           = dr::gather<Float>(m_records, record * 4 + band, inside);
            total += powers[k];
        }
        Float left = ux * total, power(1.f), start(0.f), passed(0.f);
        UInt32 chosen(0);
        Mask done(false);
        for (uint32_t k = 0; k < block_len; ++k) {
            // The last node of any power is kept where rounding leaves `left` beyond the end.
            const Mask here = !done && powers[k] > 0.f;
            chosen          = dr::select(here, UInt32(k), chosen);
            power           = dr::select(here, powers[k], power);
            start           = dr::select(here, passed, start);
            passed += powers[k];
            done |= here && left < passed;
        }
        ux = dr::clip((left - start) / power, 0.f, last);

        // Box–Muller.
        const Float radius    = dr::sqrt(-2.f * dr::log(1.f - ux));
        const auto [sin, cos] = dr::sincos(dr::TwoPi<Float> * uy);
        const Float jx        = Float(Int32(block * block_len + chosen) - int(m_layout.reach_x)),
                    jy        = Float(Int32(row) - int(m_layout.reach_y));
        const Float fx = dr::fmadd(radius * cos, float(m_layout.proposal_sigma_x), jx) / float(m_layout.period_x_um),
                    fy = dr::fmadd(radius * sin, float(m_layout.proposal_sigma_y), jy) / float(m_layout.period_y_um);
        const Float x = dr::fmsub(wavelength_um, fx, wi.x()), y = dr::fmsub(wavelength_um, fy, wi.y());
        const Float z_squared = 1.f - dr::fmadd(x, x, y * y);
        return dr::select(z_squared > 0.f, Vector3f(x, y, dr::safe_sqrt(z_squared)), Vector3f(0.f));
    }

private:
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

    /// The interval of the cumulative table of `size` intervals from `start` that holds `u`, and where in it `u` lies.
    std::pair<UInt32, Float> descend(const FloatX &cdf, const UInt32 &start, uint32_t size, const Float &u,
                                     const Mask &active) const {
        const UInt32 i = dr::binary_search<UInt32>(
            0, size - 1, [&](const UInt32 &index) { return dr::gather<Float>(cdf, start + index + 1, active) <= u; });
        const Float low    = dr::gather<Float>(cdf, start + i, active),
                    high   = dr::gather<Float>(cdf, start + i + 1, active);
        const Float inside = dr::clip((u - low) / (high - low), 0.f, dr::OneMinusEpsilon<float>);
        return { i, dr::select(high > low, inside, .5f) };
    }

    Layout m_layout;
    FloatX m_records, m_row_cdf, m_block_cdf, m_scale_corners, m_weights;
    UInt32X m_offsets;

public:
    DRJIT_TRAVERSE(Tables, m_records, m_row_cdf, m_block_cdf, m_scale_corners, m_weights, m_offsets)
};

} // namespace sunbeam
