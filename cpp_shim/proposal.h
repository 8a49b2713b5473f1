// The density that orders are drawn from, as Dr.Jit arrays: the twin of `src/reflectance/proposal.rs` and of
// `src/table/leaves.rs`, which say what it is. Names are the same there and here.
#pragma once

#include <array>
#include <string>
#include <tuple>

#include "cell_shares.h"
#include "shade.h"
#include "tables.h"

namespace sunbeam {

/// `O·M·cosθi·cosθo` of a pair of directions with the sums u, v.
template <typename T> T angular_factor(const Layout &layout, const T &u, const T &v, const T &cos_i, const T &cos_o) {
    const T w = cos_i + cos_o, sum_squared = dr::fmadd(u, u, dr::fmadd(v, v, w * w)), ratio = sum_squared / (2.f * w);
    T factor = layout.stam ? ratio * ratio : cos_i * cos_o;
    if (layout.shadowing)
        factor *= dr::minimum(4.f * w * dr::minimum(cos_i, cos_o) / sum_squared, 1.f);
    return factor;
}

template <typename Float> class Proposal {
public:
    using LobeTables                 = Tables<Float>;
    using FloatX                     = typename LobeTables::FloatX;
    using UInt32                     = typename LobeTables::UInt32;
    using Float64                    = typename LobeTables::Float64;
    using Mask                       = typename LobeTables::Mask;
    using Vector3f                   = typename LobeTables::Vector3f;
    using Point2f                    = typename LobeTables::Point2f;
    template <size_t N> using Wide   = dr::Array<Float, N>;
    template <size_t N> using Wide64 = dr::Array<Float64, N>;
    template <size_t N> using WideU  = dr::Array<UInt32, N>;
    using Packet                     = typename LobeTables::Packet;

    static constexpr uint32_t BANDS = LobeTables::BANDS;
    static constexpr size_t MET_MAX = LobeTables::LEAVES_MET_MAX;

    /// The proposal at one incidence and N wavelengths.
    template <size_t N> struct Local {
        Vector3f wi;
        Wide<N> wavelength_um, fold_cos;
        /// Direction cosines per node, and how far from its centre a leaf reaches.
        Wide64<N> step_x, step_y, reach_x, reach_y;
        /// The nodes of the shares' grid about the incidence.
        typename CellShares<Float>::template Corners<N> corners;
        /// Weight of all leaves where they are one cell.
        Wide<N> whole;
    };

    explicit Proposal(const Surface &surface) : m_layout(surface.layout()), m_shares(surface), m_shade(surface) {
        auto floats   = [](auto slice) { return dr::load<FloatX>(slice.data(), slice.size()); };
        m_leaf_powers = floats(surface.leaf_powers());
        m_leaf_places = floats(surface.leaf_places());
        m_leaf_rows   = floats(surface.leaf_rows());
    }

    template <size_t N> Local<N> at(const Vector3f &wi, const Wide<N> &wavelength_nm, const Mask &active) const {
        Local<N> local;
        local.wi            = wi;
        local.wavelength_um = wavelength_nm * 1e-3f;
        local.fold_cos      = dr::minimum(dr::sqrt(2.f * float(m_layout.fold_sigma) * local.wavelength_um), 1.f);
        const Wide64<N> um  = Wide64<N>(wavelength_nm) * 1e-3;
        local.step_x        = um / m_layout.period_x_um;
        local.step_y        = um / m_layout.period_y_um;
        local.reach_x       = local.step_x * m_layout.leaf_reach_x;
        local.reach_y       = local.step_y * m_layout.leaf_reach_y;
        if (has_cells())
            local.corners = m_shares.template corners<N>(wi, wavelength_nm, active);
        else
            local.whole = whole_weight<N>(local, active);
        return local;
    }

    /// Weights of the leaves that a look-up meets whose first node has this column and row.
    template <size_t N> typename LobeTables::template Window<N> window(const Local<N> &local, const WideU<N> &column,
                                                                       const WideU<N> &row, const Mask &active) const {
        using WideF       = Wide<N>;
        const uint32_t mx = m_layout.leaf_met_x, my = m_layout.leaf_met_y;
        typename LobeTables::template Window<N> window;
        window.first_x = column >> m_layout.leaf_shift_x;
        window.first_y = row >> m_layout.leaf_shift_y;
        auto &amount   = window.amount;
        auto &band_at  = window.band_at;
        amount.fill(WideF(0.f));
        band_at.fill(WideF(0.f));
        if (!has_cells()) {
            for (uint32_t i = 0; i < mx * my; ++i)
                std::tie(amount[i], band_at[i]) =
                    leaf<N>(local, window.first_x + i % mx, window.first_y + i / mx, active);
            const WideF scale = dr::select(local.whole > 0.f, 1.f / local.whole, 0.f);
            for (uint32_t i = 0; i < mx * my; ++i)
                amount[i] *= scale;
            return window;
        }
        // All leaves of the cells met: their weights sum up cell by cell, and some of them are met themselves.
        const uint32_t kx = m_layout.leaf_in_cell_x, ky = m_layout.leaf_in_cell_y, cx = m_layout.cells_met_x,
                       cy     = m_layout.cells_met_y;
        const WideU<N> cell_x = window.first_x / kx, cell_y = window.first_y / ky;
        std::array<WideF, MET_MAX * MET_MAX> weight, position;
        weight.fill(WideF(0.f));
        for (uint32_t c = 0; c < cx * cy; ++c)
            position[c] = cell_position<N>(local, cell_x + c % cx, cell_y + c / cx);
        UInt32 i(0);
        dr::tie(i, weight, amount) = dr::while_loop(
            dr::make_tuple(i, weight, amount),
            [&](const UInt32 &i, const auto &, const auto &) { return active && i < cx * kx * cy * ky; },
            [&](UInt32 &i, auto &weight, auto &amount) {
                const UInt32 iy = i / (cx * kx), ix = i - iy * (cx * kx);
                const WideU<N> gx = cell_x * kx + ix, gy = cell_y * ky + iy;
                const WideF part(place<N>(local, gx, gy, active).part);
                WideF at = position[0];
                for (uint32_t c = 1; c < cx * cy; ++c)
                    at = dr::select(ix / kx == c % cx && iy / ky == c / cx, position[c], at);
                const WideF power = part * leaf_power<N>(gx, gy, at, active);
                for (uint32_t c = 0; c < cx * cy; ++c)
                    weight[c] += dr::select(ix / kx == c % cx && iy / ky == c / cx, power, WideF(0.f));
                for (uint32_t k = 0; k < mx * my; ++k)
                    amount[k] =
                        dr::select(gx == window.first_x + k % mx && gy == window.first_y + k / mx, part, amount[k]);
                i += 1;
            },
            "leaves");
        for (uint32_t y = 0; y < cy; ++y) {
            const auto share = m_shares.template shares<N>(local.corners, cell_x, cell_y + y, cx, active);
            for (uint32_t x = 0; x < cx; ++x)
                weight[y * cx + x] = dr::select(weight[y * cx + x] > 0.f, share[x] / weight[y * cx + x], WideF(0.f));
        }
        for (uint32_t k = 0; k < mx * my; ++k) {
            const WideU<N> x = (window.first_x + k % mx) / kx - cell_x, y = (window.first_y + k / mx) / ky - cell_y;
            WideF scale = 0.f;
            for (uint32_t c = 0; c < cx * cy; ++c) {
                const auto here = x == c % cx && y == c / cx;
                scale           = dr::select(here, weight[c], scale);
                band_at[k]      = dr::select(here, position[c], band_at[k]);
            }
            amount[k] *= scale;
        }
        return window;
    }

    /// A direction by the orders of one wavelength, with zero for what lies too far beyond the horizon.
    Vector3f sample(const LobeTables &tables, const Vector3f &wi, const Float &wavelength_nm, const Point2f &u,
                    const Mask &active_) const {
        const Local<1> local = at<1>(wi, Wide<1>(wavelength_nm), active_);
        Mask active          = active_;
        UInt32 first_x(0), first_y(0), wide(m_layout.leaf_in_cell_x), high(m_layout.leaf_in_cell_y);
        Float ux = u.x(), uy = u.y(), at(0.f);
        if (has_cells()) {
            UInt32 cell_x, cell_y;
            std::tie(cell_x, cell_y, ux, uy) = m_shares.choose(local.corners, Point2f(ux, uy), active);
            at                               = cell_position<1>(local, WideU<1>(cell_x), WideU<1>(cell_y))[0];
            first_x                          = cell_x * m_layout.leaf_in_cell_x;
            first_y                          = cell_y * m_layout.leaf_in_cell_y;
            wide                             = dr::minimum(wide, m_layout.leaf_count_x - first_x);
            high                             = dr::minimum(high, m_layout.leaf_count_y - first_y);
        } else {
            std::tie(first_x, wide) = propagating(local.wi.x(), local.step_x[0], local.reach_x[0], true);
            std::tie(first_y, high) = propagating(local.wi.y(), local.step_y[0], local.reach_y[0], false);
        }
        UInt32 chosen;
        std::tie(chosen, uy) = pick(
            wide * high,
            [&](const UInt32 &i) {
                const WideU<1> gx(first_x + i % wide), gy(first_y + i / wide);
                if (has_cells())
                    return Float(Float(place<1>(local, gx, gy, active).part[0]) * leaf_power<1>(gx, gy, at, active)[0]);
                const auto [factor, position] = leaf<1>(local, gx, gy, active);
                return Float((factor * leaf_power<1>(gx, gy, position, active))[0]);
            },
            uy, active, "leaf");
        const UInt32 gx = first_x + chosen % wide, gy = first_y + chosen / wide;
        if (!has_cells())
            at = leaf<1>(local, WideU<1>(gx), WideU<1>(gy), active).second[0];

        const UInt32 top = gy << m_layout.leaf_shift_y, left = gx << m_layout.leaf_shift_x;
        const uint32_t rows = 2 * m_layout.reach_y + 1, columns = 2 * m_layout.reach_x + 1;
        UInt32 row, column;
        std::tie(row, uy) = pick(
            dr::minimum(1u << m_layout.leaf_shift_y, rows - top),
            [&](const UInt32 &i) {
                return at_band(m_leaf_rows, ((top + i) * m_layout.leaf_count_x + gx) * BANDS, at, active);
            },
            uy, active, "row");
        row += top;
        std::tie(column, ux) = pick(
            dr::minimum(1u << m_layout.leaf_shift_x, columns - left),
            [&](const UInt32 &i) { return tables.node_power(row * columns + left + i, at, active); }, ux, active,
            "node");
        column += left;

        // Box–Muller. The radius, which is the more sensitive, comes from the number that was stretched less.
        const Float radius    = dr::sqrt(-2.f * dr::log(1.f - uy));
        const auto [sin, cos] = dr::sincos(dr::TwoPi<Float> * ux);
        const Float jx(dr::int32_array_t<Float>(column) - int(m_layout.reach_x)),
            jy(dr::int32_array_t<Float>(row) - int(m_layout.reach_y));
        const Float fx = dr::fmadd(radius * cos, float(m_layout.proposal_sigma_x), jx) / float(m_layout.period_x_um),
                    fy = dr::fmadd(radius * sin, float(m_layout.proposal_sigma_y), jy) / float(m_layout.period_y_um);
        const Float um = local.wavelength_um[0];
        const Float x = dr::fmsub(um, fx, wi.x()), y = dr::fmsub(um, fy, wi.y());
        const Float squared = dr::fmadd(x, x, y * y);
        // Beyond the horizon, the fold.
        const Float cos_folded = (squared - 1.f) / local.fold_cos[0];
        const Float inward     = dr::safe_sqrt((1.f - cos_folded * cos_folded) / squared);
        const Vector3f folded  = dr::select(cos_folded > 0.f && cos_folded < float(m_layout.fold_cos_max),
                                            Vector3f(x * inward, y * inward, cos_folded), Vector3f(0.f));
        return dr::select(active, dr::select(squared < 1.f, Vector3f(x, y, dr::safe_sqrt(1.f - squared)), folded),
                          Vector3f(0.f));
    }

private:
    bool has_cells() const { return m_shares.present(); }

    /// The power under the band weights of a position, from band means that start at `index`.
    template <typename I>
    Float at_band(const FloatX &means, const I &index, const Float &at, const Mask &active) const {
        const UInt32 band = dr::minimum(UInt32(at), BANDS - 2);
        return dr::lerp(dr::gather<Float>(means, index + band, active),
                        dr::gather<Float>(means, index + band + 1, active), at - Float(band));
    }

    template <size_t N>
    Wide<N> leaf_power(const WideU<N> &gx, const WideU<N> &gy, const Wide<N> &at, const Mask &active) const {
        Wide<N> power;
        for (size_t k = 0; k < N; ++k) {
            const Mask there = active && gx[k] < m_layout.leaf_count_x && gy[k] < m_layout.leaf_count_y;
            power[k]         = at_band(m_leaf_powers, (gy[k] * m_layout.leaf_count_x + gx[k]) * BANDS, at[k], there);
        }
        return power;
    }

    /// A leaf as an incidence sees it: its centre of power in direction cosines, half its extent along the radius, and
    /// the part of it inside the horizon, zero for leaves that are not there.
    template <size_t N> struct Place { Wide64<N> x, y, rho, half, part; };

    template <size_t N>
    Place<N> place(const Local<N> &local, const WideU<N> &gx, const WideU<N> &gy, const Mask &active) const {
        Wide64<N> place_x, place_y, half_x, half_y;
        dr::mask_t<Wide64<N>> there;
        for (size_t k = 0; k < N; ++k) {
            there[k] = gx[k] < m_layout.leaf_count_x && gy[k] < m_layout.leaf_count_y;
            const Packet packet =
                dr::gather<Packet>(m_leaf_places, gy[k] * m_layout.leaf_count_x + gx[k], active && there[k]);
            place_x[k] = Float64(packet[0]) - double(m_layout.reach_x);
            place_y[k] = Float64(packet[1]) - double(m_layout.reach_y);
            half_x[k]  = Float64(packet[2]);
            half_y[k]  = Float64(packet[3]);
        }
        Place<N> place;
        place.x     = dr::fmsub(local.step_x, place_x, Float64(local.wi.x()));
        place.y     = dr::fmsub(local.step_y, place_y, Float64(local.wi.y()));
        place.rho   = dr::maximum(dr::sqrt(dr::fmadd(place.x, place.x, place.y * place.y)), 1e-12);
        auto radial = [&](const Wide64<N> &a, const Wide64<N> &b) {
            return dr::fmadd(dr::abs(place.x), a, dr::abs(place.y) * b) / place.rho;
        };
        auto part  = [&](const Wide64<N> &half) { return dr::clip(0.5 + 0.5 * (1.0 - place.rho) / half, 0.0, 1.0); };
        place.half = radial(local.step_x * half_x, local.step_y * half_y);
        const Wide64<N> near = part(place.half), anywhere = part(radial(local.reach_x, local.reach_y));
        const double share = m_layout.anywhere_share;
        place.part = dr::select(there, (1.0 - share) * near * near * (3.0 - 2.0 * near) + share * anywhere, 0.0);
        return place;
    }

    /// `F_l` and where its power is read among the κ bands, where all leaves are one cell.
    template <size_t N> std::pair<Wide<N>, Wide<N>> leaf(const Local<N> &local, const WideU<N> &gx, const WideU<N> &gy,
                                                         const Mask &active) const {
        const Place<N> place   = this->place<N>(local, gx, gy, active);
        const Wide64<N> inside = 1.0 - place.rho;
        const Wide64<N> inward =
            dr::minimum(dr::maximum(dr::maximum(inside, 0.5 * (inside + place.half)), 0.25 * place.half), 1.0);
        const Wide64<N> ratio = (1.0 - inward) / place.rho;
        const Wide<N> cos     = dr::sqrt(Wide<N>(dr::maximum(inward * (2.0 - inward), 1e-9)));
        const Float cos_i     = dr::maximum(local.wi.z(), 1e-7f);
        const Wide<N> u       = Wide<N>(dr::fmadd(place.x, ratio, Float64(local.wi.x()))),
                      v       = Wide<N>(dr::fmadd(place.y, ratio, Float64(local.wi.y())));
        Wide<N> factor = Wide<N>(place.part) / cos * angular_factor<Wide<N>>(m_layout, u, v, Wide<N>(cos_i), cos);
        if (m_shade.present())
            factor *= m_shade.template factor<N>(Wide<N>(place.x), Wide<N>(place.y), cos, active);
        return { dr::select(factor > 0.f, factor, Wide<N>(0.f)), band_position<N>(local, cos) };
    }

    /// Where among the κ bands a power is read towards a cosine.
    template <size_t N> Wide<N> band_position(const Local<N> &local, const Wide<N> &cos) const {
        const float bands_per_kappa = float(BANDS / m_layout.kappa_max);
        const Wide<N> kappa         = dr::TwoPi<Float> * (local.wi.z() + cos) / local.wavelength_um;
        return dr::clip(dr::fmsub(kappa, bands_per_kappa, .5f), 0.f, BANDS - 1.f);
    }

    /// Where the powers of a cell's leaves are read: at the κ of its middle.
    template <size_t N>
    Wide<N> cell_position(const Local<N> &local, const WideU<N> &cell_x, const WideU<N> &cell_y) const {
        auto middle = [](const WideU<N> &cell, uint32_t in_cell, uint32_t shift, uint32_t reach) {
            return (Wide64<N>(cell) + 0.5) * double(in_cell << shift) - (0.5 + reach);
        };
        const Wide64<N> x = dr::fmsub(local.step_x,
                                      middle(cell_x, m_layout.leaf_in_cell_x, m_layout.leaf_shift_x, m_layout.reach_x),
                                      Float64(local.wi.x())),
                        y = dr::fmsub(local.step_y,
                                      middle(cell_y, m_layout.leaf_in_cell_y, m_layout.leaf_shift_y, m_layout.reach_y),
                                      Float64(local.wi.y()));
        return band_position<N>(local, dr::sqrt(Wide<N>(dr::maximum(1.0 - x * x - y * y, 0.0))));
    }

    /// First leaf along an axis about the disc of what propagates, and the number of leaves.
    std::pair<UInt32, UInt32> propagating(const Float &wi, const Float64 &step, const Float64 &beyond,
                                          bool along_x) const {
        const uint32_t count = along_x ? m_layout.leaf_count_x : m_layout.leaf_count_y;
        const double reach   = along_x ? m_layout.reach_x : m_layout.reach_y,
                     len     = 1u << (along_x ? m_layout.leaf_shift_x : m_layout.leaf_shift_y);
        auto leaf            = [&](const Float64 &q) { return ((q + Float64(wi)) / step + reach) / len; };
        auto clipped         = [&](const Float64 &g) { return UInt32(dr::clip(g, 0.0, double(count))); };
        // At least one, since their number divides; beyond the last leaf there is nothing.
        const UInt32 low = clipped(leaf(-1.0 - beyond) - 1.0), high = clipped(leaf(1.0 + beyond) + 1.0);
        return { low, dr::maximum(high - low, 1u) };
    }

    /// Weight of all leaves, where they are one cell.
    template <size_t N> Wide<N> whole_weight(const Local<N> &local, const Mask &active) const {
        Wide<N> result;
        for (size_t k = 0; k < N; ++k) {
            const auto [first_x, wide] = propagating(local.wi.x(), local.step_x[k], local.reach_x[k], true);
            const auto [first_y, high] = propagating(local.wi.y(), local.step_y[k], local.reach_y[k], false);
            const Local<1> one         = single<N>(local, k);
            UInt32 i(0);
            Float sum(0.f);
            const UInt32 x0 = first_x, y0 = first_y, columns = wide, count = wide * high;
            dr::tie(i, sum) = dr::while_loop(
                dr::make_tuple(i, sum), [&](const UInt32 &i, const Float &) { return active && i < count; },
                [&](UInt32 &i, Float &sum) {
                    const WideU<1> gx(x0 + i % columns), gy(y0 + i / columns);
                    const auto [factor, at] = leaf<1>(one, gx, gy, active);
                    sum += (factor * leaf_power<1>(gx, gy, at, active))[0];
                    i += 1;
                },
                "orders");
            result[k] = sum;
        }
        return result;
    }

    /// What `leaf` reads of one wavelength.
    template <size_t N> static Local<1> single(const Local<N> &local, size_t k) {
        Local<1> one;
        one.wi            = local.wi;
        one.wavelength_um = local.wavelength_um[k];
        one.step_x        = local.step_x[k];
        one.step_y        = local.step_y[k];
        one.reach_x       = local.reach_x[k];
        one.reach_y       = local.reach_y[k];
        return one;
    }

    /// One of `count` numbers by its weight, and where in its interval `u` lies; where all weights are zero, `active`
    /// is left false.
    template <typename Weight> static std::pair<UInt32, Float> pick(const UInt32 &count, Weight weight, const Float &u,
                                                                    Mask &active, const char *name) {
        UInt32 i(0);
        Float total(0.f);
        const Mask asked  = active;
        dr::tie(i, total) = dr::while_loop(
            dr::make_tuple(i, total), [&](const UInt32 &i, const Float &) { return asked && i < count; },
            [&](UInt32 &i, Float &total) {
                total += weight(i);
                i += 1;
            },
            name);
        active &= total > 0.f;
        const Mask found   = active;
        const Float target = u * total;
        UInt32 chosen(0);
        Float passed(0.f), start(0.f), width(1.f);
        i                                        = UInt32(0);
        dr::tie(i, chosen, passed, start, width) = dr::while_loop(
            dr::make_tuple(i, chosen, passed, start, width),
            [&](const UInt32 &i, const UInt32 &, const Float &passed, const Float &, const Float &) {
                return found && i < count && passed <= target;
            },
            [&](UInt32 &i, UInt32 &chosen, Float &passed, Float &start, Float &width) {
                const Float w   = weight(i);
                const Mask here = w > 0.f;
                chosen          = dr::select(here, i, chosen);
                start           = dr::select(here, passed, start);
                width           = dr::select(here, w, width);
                passed += w;
                i += 1;
            },
            name);
        return { chosen, dr::clip((target - start) / width, 0.f, dr::OneMinusEpsilon<float>) };
    }

    Layout m_layout;
    CellShares<Float> m_shares;
    Shade<Float> m_shade;
    FloatX m_leaf_powers, m_leaf_places, m_leaf_rows;

public:
    DRJIT_TRAVERSE(Proposal, m_shares, m_shade, m_leaf_powers, m_leaf_places, m_leaf_rows)
};

} // namespace sunbeam
