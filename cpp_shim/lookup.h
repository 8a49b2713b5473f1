// The diffraction lobe: evaluation and sampling of one surface, by the Rust core in scalar variants and by look-ups in
// its tables where Dr.Jit traces. The twin of `src/reflectance/surface.rs` and `integrated.rs`.
#pragma once

#include <algorithm>
#include <utility>

#include <mitsuba/core/spectrum.h>
#include <mitsuba/core/warp.h>
#include <mitsuba/render/bsdf.h>

#include "lobe.h"
#include "proposal.h"

namespace sunbeam {

/// Diffraction by one surface, integrated over wavelength. Directions are in the grating's frame and point away from the surface; both cosines
/// are positive where `active` holds. Wavelengths are in nm in spectral variants and empty in the others, which
/// integrate over wavelength.
template <typename Float, typename Spectrum> class IntegratedLobe {
public:
    using UnpolarizedSpectrum        = mitsuba::unpolarized_spectrum_t<Spectrum>;
    using Wavelength                 = mitsuba::wavelength_t<Spectrum>;
    using Vector3f                   = mitsuba::Vector<Float, 3>;
    using Point2f                    = mitsuba::Point<Float, 2>;
    using Mask                       = drjit::mask_t<Float>;
    using Value                      = std::pair<UnpolarizedSpectrum, Float>;

    explicit IntegratedLobe(rust::Box<Surface> surface)
        : m_surface(std::move(surface)), m_tables(*m_surface), m_proposal(*m_surface) {}

    /// The value is differentiable by both directions. The density is not: it belongs to the sampler, not to the
    /// integrand.
    Value eval_pdf(const Vector3f &wi, const Vector3f &wo, const Wavelength &wavelengths, const Mask &active) const {
        Value answer = detached(dr::detach(wi), dr::detach(wo), wavelengths, active);
        if constexpr (dr::is_diff_v<Float>)
            if (dr::grad_enabled(wi) || dr::grad_enabled(wo))
                answer.first += first_order(wi, wo, wavelengths, active);
        return answer;
    }

    UnpolarizedSpectrum eval(const Vector3f &wi, const Vector3f &wo, const Wavelength &w, const Mask &active) const {
        return eval_pdf(wi, wo, w, active).first;
    }

    Float pdf(const Vector3f &wi, const Vector3f &wo, const Wavelength &w, const Mask &active) const {
        return eval_pdf(wi, wo, w, active).second;
    }

    /// A direction from three uniform variates; its density is that of `eval_pdf`. Zero where there is none.
    Vector3f sample(const Vector3f &wi, const Wavelength &, const Float &sample1, const Point2f &sample2,
                    const Mask &active) const {
        const float share  = float(m_tables.layout().uniform_share);
        const Mask uniform = sample1 < share;
        Float rest         = dr::maximum((sample1 - share) / (1.f - share), 0.f), wavelength_nm;
        wavelength_nm = mitsuba::sample_rgb_spectrum(rest).first;
        const Vector3f order = m_proposal.sample(m_tables, wi, in_range(wavelength_nm), sample2, active && !uniform);
        const Float z = 1.f - sample2.x(), r = dr::safe_sqrt(1.f - z * z);
        const auto [sin, cos] = dr::sincos(dr::TwoPi<Float> * sample2.y());
        return dr::select(uniform, Vector3f(r * cos, r * sin, z), order);
    }

    const Surface &surface() const { return *m_surface; }

private:
    template <size_t N> using Wide = dr::Array<Float, N>;

    Value detached(const Vector3f &wi, const Vector3f &wo, const Wavelength &, const Mask &active) const {
        return integrated(wi, wo, active);
    }

    /// Zero, with the derivatives of the value by the components of both directions, from central differences.
    ///
    /// The look-ups loop over nodes, whose number and places depend on the directions, and such loops cannot be run
    /// backwards. The table is smooth on the scale of an order's width and of a knot in κ, so a step of a twentieth of
    /// these is off by 4e-4 of the slope.
    UnpolarizedSpectrum first_order(const Vector3f &wi, const Vector3f &wo, const Wavelength &wavelengths,
                                    const Mask &active) const {
        using UInt32           = typename Tables<Float>::UInt32;
        constexpr float STEP   = .05f;
        const Layout &layout   = m_tables.layout();
        const float shortest   = float(layout.wavelength_min_nm * 1e-3);
        const float across[]   = { STEP * shortest * float(layout.sigma_x / layout.period_x_um),
                                   STEP * shortest * float(layout.sigma_y / layout.period_y_um) };
        const float along      = STEP * std::min(shortest * float(layout.kappa_step) / (2.f * dr::Pi<float>), 1.f);
        const Vector3f from[2] = { dr::detach(wi), dr::detach(wo) };
        UInt32 i(0);
        dr::Array<UnpolarizedSpectrum, 6> slopes(UnpolarizedSpectrum(0.f));
        dr::tie(i, slopes) = dr::while_loop(
            dr::make_tuple(i, slopes),
            [&](const UInt32 &i, const dr::Array<UnpolarizedSpectrum, 6> &) { return active && i < 12u; },
            [&](UInt32 &i, dr::Array<UnpolarizedSpectrum, 6> &slopes) {
                const Float sign = dr::select((i & 1u) == 0u, Float(1.f), Float(-1.f));
                Vector3f to[2]   = { from[0], from[1] };
                Float distance(0.f);
                for (uint32_t c = 0; c < 6; ++c) {
                    const Float here = from[c / 3][c % 3];
                    // Not through the horizon.
                    const Float step = c % 3 < 2 ? Float(across[c % 3]) : dr::minimum(along, .25f * here);
                    const auto moves = (i >> 1) == c;
                    to[c / 3][c % 3] += dr::select(moves, sign * step, 0.f);
                    // What is left of the steps in single precision.
                    distance = dr::select(moves, (here + step) - (here - step), distance);
                }
                const UnpolarizedSpectrum value = detached(to[0], to[1], wavelengths, active).first;
                for (uint32_t c = 0; c < 6; ++c)
                    slopes[c] += dr::select((i >> 1) == c, value * (sign / distance), 0.f);
                i += 1;
            },
            "slopes");
        UnpolarizedSpectrum change(0.f);
        for (uint32_t c = 0; c < 6; ++c)
            change += slopes[c] * ((c < 3 ? wi[c % 3] : wo[c % 3]) - from[c / 3][c % 3]);
        return change;
    }

    Float in_range(const Float &wavelength_nm) const {
        return dr::clip(wavelength_nm, float(m_tables.layout().wavelength_min_nm),
                        float(m_tables.layout().wavelength_max_nm));
    }

    /// `f_r cosθo` at one wavelength into `value`; returns its density.
    Float at_wavelength(const Vector3f &wi, const Vector3f &wo, const Float &nm, const Mask &active,
                        Float &value) const {
        constexpr size_t N          = 1;
        const Wide<N> wavelength_nm = nm;
        using Wide64                = dr::Array<typename Tables<Float>::Float64, N>;
        const Layout &layout        = m_tables.layout();
        const Wide<N> wavelength_um = wavelength_nm * 1e-3f;
        const auto local            = m_proposal.template at<N>(wi, wavelength_nm, active);
        const auto position         = m_tables.template position<N>(wi, wo, Wide64(1.0), wavelength_nm);
        const auto window           = m_proposal.template window<N>(local, position.column, position.row, active);
        const Wide<N> kappa         = dr::TwoPi<Float> * (wi.z() + wo.z()) / wavelength_um;
        const auto density          = m_tables.template lookup<N>(position, kappa, window, active);

        // What the fold brings here lies at ρ² = 1 + c cosθo.
        const Mask low           = active && wo.z() < float(layout.fold_cos_max);
        const Wide64 further     = dr::sqrt(dr::fmadd(Wide64(local.fold_cos), Wide64(wo.z()), 1.0) /
                                            Wide64(dr::maximum(1.f - wo.z() * wo.z(), .5f)));
        const auto beyond        = m_tables.template position<N>(wi, wo, further, wavelength_nm);
        const auto beyond_window = m_proposal.template window<N>(local, beyond.column, beyond.row, low);
        Wide<N> folded           = .5f * local.fold_cos * m_tables.template proposal<N>(beyond, beyond_window, low);
        folded                   = dr::select(low, folded, Wide<N>(0.f));

        const Wide<N> per_area = 1.f / (wavelength_um * wavelength_um);
        Wide<N> scale          = m_tables.template scale<N>(wi, wavelength_um, active);
        scale *= m_tables.template scale<N>(wo, wavelength_um, active);
        const Float share(layout.uniform_share);
        const Float cos_i = dr::maximum(wi.z(), 1e-7f), cos_o = dr::maximum(wo.z(), 1e-7f);
        const Float angular =
            angular_factor<Float>(layout, wi.x() + wo.x(), wi.y() + wo.y(), cos_i, cos_o) / (cos_i * cos_o);
        value                = angular * wo.z() * (scale * density.value * per_area)[0];
        const Float proposed = (dr::fmadd(density.proposal, wo.z(), folded) * per_area)[0];
        return (1.f - share) * proposed + share * dr::InvTwoPi<Float>;
    }

    /// Both integrated over wavelength, by the midpoint rule in the wavenumber.
    Value integrated(const Vector3f &wi, const Vector3f &wo, const Mask &active) const {
        using Packet            = typename Tables<Float>::Packet;
        const Layout &layout    = m_tables.layout();
        const Vector3f sum      = wi + wo;
        const float first       = float(1e3 / layout.wavelength_max_nm);
        const float span        = float(1e3 / layout.wavelength_min_nm) - first;
        const float step_sigmas = 1.5f, steps_min = 64.f, steps_max = 1024.f;
        const Float orders = dr::sqrt(dr::square(sum.x() * float(layout.period_x_um / layout.sigma_x)) +
                                      dr::square(sum.y() * float(layout.period_y_um / layout.sigma_y))) /
                             step_sigmas;
        const Float knots = dr::TwoPi<Float> * sum.z() / float(layout.kappa_step);
        const Float steps = dr::floor(dr::clip(span * dr::maximum(orders, knots), steps_min, steps_max));
        const Float step  = span / steps;

        Float k(0.f), pdf(0.f);
        Packet rgb_y(0.f);
        dr::tie(k, rgb_y, pdf) = dr::while_loop(
            dr::make_tuple(k, rgb_y, pdf),
            [&](const Float &k, const Packet &, const Float &) { return active && k < steps; },
            [&](Float &k, Packet &rgb_y, Float &pdf) {
                const Float nm = 1e3f / dr::fmadd(k + .5f, step, first);
                Float value;
                const Float density  = at_wavelength(wi, wo, nm, active, value);
                const Float width_nm = step * dr::square(nm) * 1e-3f;
                rgb_y += value * width_nm * m_tables.wavelength_weight(nm, active);
                pdf += density * width_nm * mitsuba::pdf_rgb_spectrum(nm);
                k += 1.f;
            },
            "wavelengths");
        return { in_colour(dr::maximum(rgb_y, 0.f)), pdf };
    }

    static UnpolarizedSpectrum in_colour(const dr::Array<Float, 4> &rgb_y) {
        if constexpr (UnpolarizedSpectrum::Size == 1)
            return UnpolarizedSpectrum(rgb_y[3]);
        else
            return UnpolarizedSpectrum(rgb_y[0], rgb_y[1], rgb_y[2]);
    }

    rust::Box<Surface> m_surface;
    Tables<Float> m_tables;
    Proposal<Float> m_proposal;

public:
    DRJIT_TRAVERSE(IntegratedLobe, m_tables, m_proposal)
};

/// Scalar variants ask the Rust core, ray by ray.
template <typename Spectrum> class IntegratedLobe<float, Spectrum> {
public:
    using UnpolarizedSpectrum = mitsuba::unpolarized_spectrum_t<Spectrum>;
    using Wavelength          = mitsuba::wavelength_t<Spectrum>;
    using Vector3f            = mitsuba::Vector<float, 3>;
    using Point2f             = mitsuba::Point<float, 2>;
    using Value               = std::pair<UnpolarizedSpectrum, float>;

    explicit IntegratedLobe(rust::Box<Surface> surface) : m_surface(std::move(surface)) {}

    Value eval_pdf(const Vector3f &wi, const Vector3f &wo, const Wavelength &, bool /*active*/) const {
        std::array<float, 4> rgb_y;
        const float pdf = m_surface->eval_pdf_integrated(array(wi), array(wo), rgb_y);
        return { UnpolarizedSpectrum(rgb_y[0], rgb_y[1], rgb_y[2]) * wo.z(), pdf };
    }

    UnpolarizedSpectrum eval(const Vector3f &wi, const Vector3f &wo, const Wavelength &w, bool active) const {
        return eval_pdf(wi, wo, w, active).first;
    }

    float pdf(const Vector3f &wi, const Vector3f &wo, const Wavelength &w, bool active) const {
        return eval_pdf(wi, wo, w, active).second;
    }

    Vector3f sample(const Vector3f &wi, const Wavelength &, float sample1, const Point2f &sample2,
                    bool /*active*/) const {
        const auto wo = m_surface->sample_integrated(array(wi), { sample1, sample2.x(), sample2.y() });
        return { wo[0], wo[1], wo[2] };
    }

    const Surface &surface() const { return *m_surface; }

private:
    static std::array<float, 3> array(const Vector3f &v) { return { v.x(), v.y(), v.z() }; }

    rust::Box<Surface> m_surface;
};

/// The lobe of a variant.
template <typename Float, typename Spectrum>
using DiffractionLobe = std::conditional_t<mitsuba::is_spectral_v<Spectrum>, SpectralLobe<Float, Spectrum>,
                                           IntegratedLobe<Float, Spectrum>>;

} // namespace sunbeam
