// Optics of a transparent body: a dielectric that reflects and transmits. The lobe in Rust (src/lobe/transmissive.rs)
// has the value for unpolarised light. Polarisation, the flat side's mirror, and the change of radiance by the squared
// index are here.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include <mitsuba/core/warp.h>
#include <mitsuba/render/bsdf.h>
#include <mitsuba/render/fresnel.h>
#include <mitsuba/render/mueller.h>

#include "interface.h"
#include "lobe.h"
#include "rotation.h"
#include "textures.h"

namespace sunbeam {

/// Reflection and transmission by a relief between air, above, and a lossless medium, below: the *body*. An *interface*
/// is a body without an end. A *film* is a layer with a flat lower side, its *back*, and air behind the back. The
/// *mirror* is the reflection at the back for light from below.
///
/// Directions are unit vectors in the shading frame and point away from the surface. Below an interface they are
/// directions in the medium, below a film in the air behind its flat side.
template <typename Float, typename Spectrum> class Transmission {
public:
    MI_IMPORT_TYPES(Texture)
    using Lobe = DiffractionLobe<Float, Spectrum>;

    /// A body of index `eta`. Only a film has a back, whose mirror reflection may be left out.
    Transmission(float eta, bool is_film, bool back_reflection)
        : m_eta(eta), m_is_film(is_film), m_back_reflection(is_film && back_reflection) {}

    /// `BSDFFlags` of each component: diffracted reflection and transmission, and the back's mirror if there is one.
    /// `varies` tells whether they vary with the point on the surface. Transmission into a medium is not symmetric,
    /// because radiance changes with the squared index.
    std::vector<uint32_t> components(bool varies) const {
        const uint32_t sides = BSDFFlags::FrontSide | BSDFFlags::BackSide | BSDFFlags::Anisotropic |
                               (varies ? +BSDFFlags::SpatiallyVarying : 0u);
        const uint32_t transmission =
            +BSDFFlags::GlossyTransmission | sides | (m_is_film ? 0u : +BSDFFlags::NonSymmetric);
        std::vector<uint32_t> components = { +BSDFFlags::GlossyReflection | sides, transmission };
        if (m_back_reflection)
            components.push_back(BSDFFlags::DeltaReflection | BSDFFlags::BackSide);
        return components;
    }

    /// Whether the mirror reflection by a film's flat side is a component.
    bool reflects_at_back() const { return m_back_reflection; }

    /// A direction, and its value times |cosθo| over its density. `sample1` chooses the mirror or the lobe. Rescaled,
    /// it is the lobe's first of three variates, which chooses reflection or transmission; draws of a disabled
    /// component weigh zero. The mirror has a probability in place of a density.
    std::pair<BSDFSample3f, Spectrum> sample(const Lobe &lobe, const Textures<Float, Spectrum> &textures,
                                             const BSDFContext &ctx, const SurfaceInteraction3f &si, Float sample1,
                                             const Point2f &sample2, Mask active) const {
        BSDFSample3f bs = dr::zeros<BSDFSample3f>();
        const Enabled enabled(ctx, m_back_reflection);
        const Float cos_theta_i = Frame3f::cos_theta(si.wi);
        active &= cos_theta_i != 0.f;
        if (unlikely(enabled.none() || dr::none_or<false>(active)))
            return { bs, 0.f };

        const SurfacePoint point(textures, si, active);
        const Float prob_mirror = mirror_probability(cos_theta_i, enabled);
        const Mask pick_mirror  = sample1 < prob_mirror;
        // Uniform in [0, 1) again, given that the mirror is not picked.
        sample1 = dr::clip((sample1 - prob_mirror) / dr::maximum(1.f - prob_mirror, dr::Epsilon<Float>), 0.f,
                           dr::OneMinusEpsilon<Float>);
        const Vector3f wo =
            point.rotation.to_shading(lobe.sample(dr::detach(point.rotation.to_relief(si.wi)), si.wavelengths,
                                                  point.size, sample1, sample2, active && !pick_mirror));
        // Directions and densities are detached: derivatives are those of the integrand at the sampled directions.
        bs.wo                     = dr::detach(wo);
        const Float cos_theta_o   = Frame3f::cos_theta(bs.wo);
        const Mask is_transmitted = cos_theta_i * cos_theta_o < 0.f;
        // Index of the medium behind the surface over that in front, seen along the path.
        const Float relative = dr::select(cos_theta_i > 0.f, Float(m_eta), Float(1.f / m_eta));
        bs.eta               = m_is_film ? Float(1.f) : dr::select(is_transmitted, relative, Float(1.f));
        bs.sampled_component = dr::select(is_transmitted, UInt32(TRANSMISSION), UInt32(REFLECTION));
        bs.sampled_type =
            dr::select(is_transmitted, UInt32(+BSDFFlags::GlossyTransmission), UInt32(+BSDFFlags::GlossyReflection));
        const auto [value, pdf] =
            evaluate<true, true>(lobe, point, enabled, ctx, si, bs.wo, active && !pick_mirror && cos_theta_o != 0.f);
        const Mask is_sampled = active && pdf > 0.f;
        bs.pdf                = dr::select(is_sampled, pdf, 0.f);
        Spectrum weight       = (dr::select(is_sampled, dr::rcp(pdf), 0.f) * value) & is_sampled;
        if (enabled.mirror) {
            const Vector3f mirror                         = reflect(si.wi);
            dr::masked(bs.wo, pick_mirror)                = dr::detach(mirror);
            dr::masked(bs.eta, pick_mirror)               = 1.f;
            dr::masked(bs.pdf, pick_mirror)               = dr::select(active, prob_mirror, 0.f);
            dr::masked(bs.sampled_component, pick_mirror) = UInt32(MIRROR);
            dr::masked(bs.sampled_type, pick_mirror)      = UInt32(+BSDFFlags::DeltaReflection);
            const auto [from, to]                         = along_light(ctx, si.wi, mirror);
            const Spectrum mirrored                       = mirror_matrix(from, to);
            weight = dr::select(pick_mirror, (mirrored / prob_mirror) & (active && prob_mirror > 0.f), weight);
        }
        return { bs, weight };
    }

    /// BSDF times |cosθo|, and density in 1/sr with which `sample` draws `wo`, over the enabled components. A part
    /// whose template argument is false has no meaning.
    template <bool Value, bool Density>
    std::pair<Spectrum, Float> answer(const Lobe &lobe, const Textures<Float, Spectrum> &textures,
                                      const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo,
                                      Mask active) const {
        active &= Frame3f::cos_theta(si.wi) != 0.f && Frame3f::cos_theta(wo) != 0.f;
        const Enabled enabled(ctx, m_back_reflection);
        if (unlikely(enabled.none() || dr::none_or<false>(active)))
            return { 0.f, 0.f };
        return evaluate<Value, Density>(lobe, SurfacePoint(textures, si, active), enabled, ctx, si, wo, active);
    }

private:
    /// Numbers of the components.
    static constexpr uint32_t REFLECTION = 0, TRANSMISSION = 1, MIRROR = 2;

    /// Whether each component exists and is enabled by the caller's context.
    struct Enabled {
        bool reflection, transmission, mirror;

        Enabled(const BSDFContext &ctx, bool has_mirror)
            : reflection(ctx.is_enabled(BSDFFlags::GlossyReflection, REFLECTION)),
              transmission(ctx.is_enabled(BSDFFlags::GlossyTransmission, TRANSMISSION)),
              mirror(has_mirror && ctx.is_enabled(BSDFFlags::DeltaReflection, MIRROR)) {}
        bool none() const { return !reflection && !transmission && !mirror; }
    };

    /// Values of the textures at a point.
    struct SurfacePoint {
        UnpolarizedSpectrum specular_reflectance, specular_transmittance;
        /// Size of pattern and heights relative to the relief.
        typename Lobe::Size size;
        Rotation<Float> rotation;

        SurfacePoint(const Textures<Float, Spectrum> &textures, const SurfaceInteraction3f &si, const Mask &active)
            : specular_reflectance(textures.specular_reflectance->eval(si, active)),
              specular_transmittance(textures.specular_transmittance->eval(si, active)),
              size(textures.size(si, active)),
              rotation(Rotation<Float>::degrees(textures.rotation->eval_1(si, active))) {}
    };

    /// Directions `{ from, to }` along the light's travel: from `wo` to `wi` in the radiance mode, else from `wi` to
    /// `wo`.
    static std::pair<Vector3f, Vector3f> along_light(const BSDFContext &ctx, const Vector3f &wi, const Vector3f &wo) {
        if (ctx.mode == TransportMode::Radiance)
            return { wo, wi };
        return { wi, wo };
    }

    /// Probability that `sample` picks the mirror. Where `wi` lies below the surface, it is the mirror's reflectance,
    /// or 1 if no other component is enabled. Where `wi` lies above, it is 0.
    Float mirror_probability(const Float &cos_theta_i, const Enabled &enabled) const {
        if (!enabled.mirror)
            return Float(0.f);
        const Float below = enabled.reflection || enabled.transmission
                                ? dr::detach(std::get<0>(mitsuba::fresnel(dr::abs(cos_theta_i), Float(m_eta))))
                                : Float(1.f);
        return dr::select(cos_theta_i < 0.f, below, 0.f);
    }

    /// `answer` with the textures' values in `point`. Neither cosine is zero where `active` is true. The mirror adds
    /// nothing, since it reflects into a single direction.
    template <bool Value, bool Density>
    std::pair<Spectrum, Float> evaluate(const Lobe &lobe, const SurfacePoint &point, const Enabled &enabled,
                                        const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo,
                                        Mask active) const {
        const Float cos_theta_i = Frame3f::cos_theta(si.wi), cos_theta_o = Frame3f::cos_theta(wo);
        const Mask is_transmitted = cos_theta_i * cos_theta_o < 0.f;
        active &= (is_transmitted && enabled.transmission) || (!is_transmitted && enabled.reflection);
        const Vector3f wi_relief = point.rotation.to_relief(si.wi), wo_relief = point.rotation.to_relief(wo);
        [[maybe_unused]] const UnpolarizedSpectrum specular =
            dr::select(is_transmitted, point.specular_transmittance, point.specular_reflectance);
        Spectrum value(0.f);
        Float pdf(0.f);
        // In the rigorous theory each diffraction order has a Mueller matrix of its own. In the scalar theory all light
        // of a pair of directions has the same matrix.
        if (is_polarized_v<Spectrum> && lobe.surface().is_rigorous()) {
            if constexpr (Value)
                value = specular * order_matrices(lobe, point, ctx, si, wo, active);
            if constexpr (Density)
                pdf = lobe.pdf(wi_relief, wo_relief, si.wavelengths, point.size, active);
        } else {
            const auto [lobe_value, density] =
                lobe.template answer<Value, Density>(wi_relief, wo_relief, si.wavelengths, point.size, active);
            pdf = density;
            if constexpr (Value) {
                UnpolarizedSpectrum power = lobe_value * specular;
                // The lobe has f(wi → wo)·|cosθo|. In the radiance mode light travels from wo to wi:
                // by reciprocity f(wo → wi) = f(wi → wo) ni²/no², with the index ni on the side of wi and no of wo.
                if (ctx.mode == TransportMode::Radiance && !m_is_film)
                    power *=
                        dr::select(is_transmitted, dr::select(cos_theta_i > 0.f, 1.f / (m_eta * m_eta), m_eta * m_eta),
                                   Float(1.f));
                if constexpr (is_polarized_v<Spectrum>) {
                    const auto [from, to] = along_light(ctx, si.wi, wo);
                    value                 = power * mueller(from, to);
                } else {
                    value = power;
                }
            }
        }
        pdf *= 1.f - mirror_probability(cos_theta_i, enabled);
        return { value & active, dr::select(active, pdf, 0.f) };
    }

    /// BSDF of a rigorous body in 1/sr as a Mueller matrix, the sum over orders, times |cosθo| and between Mitsuba's
    /// frames of reference. It is evaluated along the light's travel, so neither transport mode needs the factor of the
    /// squared index. Zero in unpolarised variants.
    Spectrum order_matrices([[maybe_unused]] const Lobe &lobe, [[maybe_unused]] const SurfacePoint &point,
                            [[maybe_unused]] const BSDFContext &ctx, [[maybe_unused]] const SurfaceInteraction3f &si,
                            [[maybe_unused]] const Vector3f &wo, [[maybe_unused]] const Mask &active) const {
        if constexpr (is_polarized_v<Spectrum>) {
            const auto [from, to] = along_light(ctx, si.wi, wo);
            const Spectrum matrix =
                lobe.matrix(point.rotation.to_relief(from), point.rotation.to_relief(to), si.wavelengths, active);
            return Interface<Float, Spectrum>::in_stokes_bases(matrix, from, point.rotation.groove_axis(from), to,
                                                               point.rotation.groove_axis(to)) *
                   dr::abs(dr::detach(Frame3f::cos_theta(wo)));
        }
        return Spectrum(0.f);
    }

    /// Terms of one direction in the Jones matrix; symbols as in src/scattering/transparent.rs.
    ///
    /// | symbol | meaning |
    /// | --- | --- |
    /// | n, ε | index of the medium, `eta`, and its square, `eps` |
    /// | K | wave vector of the direction over the wave number in vacuum: of length n in the medium, 1 in air |
    /// | k | length of the tangential part of K |
    /// | c1, cn | normal components in air and in the medium, √(1 − k²) and √(n² − k²) |
    /// | v, e | cn and n for a direction above; n c1 and 1 below |
    /// | s, p | denominators of the states s and p, c1 + cn and ε c1 + cn |
    /// | τ | 1; below a film the transmittance of its flat side, 4 c1 cn / s² and 4 ε c1 cn / p² |
    ///
    /// Beyond k = 1, c1 is +i√(k² − 1), for waves exp(−iωt).
    struct Terms {
        using Complex  = dr::Complex<Float>;
        using Vector2f = mitsuba::Vector<Float, 2>;

        Mask is_below;
        /// Tangential part of K.
        Vector2f tangential;
        /// k.
        Float length;
        Complex v, s, p;
        Float e;
        /// Amplitudes √τ of the states s and p.
        Float passed_s, passed_p;

        /// Terms of the direction `w` in the shading frame, a unit vector.
        Terms(const Vector3f &w, float eta, bool is_film) {
            const Float cos      = dr::abs(w.z());
            is_below             = w.z() < 0.f;
            const Mask in_medium = is_film ? Mask(false) : is_below;
            tangential           = Vector2f(w.x(), w.y()) * dr::select(in_medium, Float(eta), Float(1.f));
            length               = dr::sqrt(dr::maximum(dr::squared_norm(tangential), LENGTH_SQUARED_MIN));
            // k² is ε(1 − cos²) for a direction in the medium, and 1 − cos² for one in air.
            const Float eps = eta * eta, cos_squared = cos * cos;
            const Float c1_squared = dr::select(in_medium, dr::fmadd(cos_squared, eps, 1.f - eps), cos_squared);
            const Float cn         = dr::sqrt(dr::select(in_medium, cos_squared * eps, cos_squared + (eps - 1.f)));
            const Complex c1(dr::sqrt(dr::maximum(c1_squared, 0.f)), dr::sqrt(dr::maximum(-c1_squared, 0.f)));
            s        = c1 + cn;
            p        = eps * c1 + cn;
            v        = dr::select(is_below, c1 * Float(eta), Complex(cn));
            e        = dr::select(is_below, Float(1.f), Float(eta));
            passed_s = passed_p = 1.f;
            if (is_film) {
                const Float root = 2.f * dr::sqrt(dr::real(c1) * cn);
                passed_s         = dr::select(is_below, root / dr::real(s), 1.f);
                passed_p         = dr::select(is_below, root * eta / dr::real(p), 1.f);
            }
        }

    private:
        /// Smallest k² whose root is taken, because the root has no derivative at zero.
        static constexpr float LENGTH_SQUARED_MIN = 1e-12f;
    };

    /// Mueller matrix of light that arrives from `from` and leaves towards `to`, divided by its first element, and
    /// between Mitsuba's frames of reference. One matrix applies to all light of a pair of directions, so nothing is
    /// depolarised. `Terms` has the symbols.
    ///
    /// The amplitudes are proportional to the following, times √τ √τ0 of the two states:
    ///
    ///     ss = cosφ/(s s0)         sp = a0 v0 sinφ/(s p0)
    ///     ps = a v sinφ/(p s0)     pp = −σ (v v0 cosφ − σ e e0 k k0)/(p p0)
    ///
    /// The first letter is the outgoing state, and 0 marks the incident direction. φ is the azimuth from the incident
    /// to the outgoing direction of travel. The sign a of a direction is 1 below and −1 above the surface. σ = a a0 is
    /// 1 for reflection and −1 for transmission. These signs, which the sum of squares in transparent.rs does not need,
    /// are those of states with p along travel × s. In code, `in` and `out` mark the incident and the outgoing
    /// direction.
    Spectrum mueller([[maybe_unused]] const Vector3f &from, [[maybe_unused]] const Vector3f &to) const {
        if constexpr (is_polarized_v<Spectrum>) {
            using Complex = typename Terms::Complex;
            const Terms in(from, m_eta, m_is_film), out(to, m_eta, m_is_film);
            // Tangential unit vectors of travel. `sign` is −1 for `from`, against which the light travels, and 1 for
            // `to`. A direction along the normal takes the other's vector; if both are along it, x is taken.
            auto unit = [](const Terms &terms, const Terms &other, float sign) {
                const auto own    = sign * terms.tangential / terms.length,
                           others = -sign * other.tangential / other.length;
                const auto fallback =
                    dr::select(other.length > TANGENT_MIN, others, typename Terms::Vector2f(1.f, 0.f));
                return dr::select(terms.length > TANGENT_MIN, own, fallback);
            };
            const auto travel_in = unit(in, out, -1.f), travel_out = unit(out, in, 1.f);
            const Float cos   = dr::dot(travel_in, travel_out),
                        sin   = travel_in.x() * travel_out.y() - travel_in.y() * travel_out.x();
            const Float a_in  = dr::select(in.is_below, Float(1.f), Float(-1.f)),
                        a_out = dr::select(out.is_below, Float(1.f), Float(-1.f)), sigma = a_in * a_out;
            // The product k k0, exactly zero for a direction along the normal, where `length` is bounded from below.
            const Float k_k0 = dr::select(in.length > TANGENT_MIN, in.length, 0.f) *
                               dr::select(out.length > TANGENT_MIN, out.length, 0.f);
            const Complex ss = Complex(cos) / (out.s * in.s) * (out.passed_s * in.passed_s),
                          sp = in.v * (a_in * sin) / (out.s * in.p) * (out.passed_s * in.passed_p),
                          ps = out.v * (a_out * sin) / (out.p * in.s) * (out.passed_p * in.passed_s),
                          pp = (out.v * in.v * cos - Complex(sigma * out.e * in.e * k_k0)) * (-sigma) / (out.p * in.p) *
                               (out.passed_p * in.passed_p);
            // Spectrum that has the complex number z at every wavelength.
            auto wide = [](const Complex &z) {
                return dr::Complex<UnpolarizedSpectrum>(UnpolarizedSpectrum(dr::real(z)),
                                                        UnpolarizedSpectrum(dr::imag(z)));
            };
            const Spectrum matrix =
                Interface<Float, Spectrum>::jones_to_mueller(wide(ss), wide(sp), wide(ps), wide(pp));
            const UnpolarizedSpectrum power = matrix(0, 0);
            // Axes of the s states: z × travel.
            const Vector3f s_in(-travel_in.y(), travel_in.x(), 0.f), s_out(-travel_out.y(), travel_out.x(), 0.f);
            return Interface<Float, Spectrum>::in_stokes_bases(dr::select(power > 0.f, dr::rcp(power), 0.f) * matrix,
                                                               from, s_in, to, s_out);
        }
        return Spectrum(1.f);
    }

    /// Mirror reflection by a film's flat side of light from `from` towards `to`, between Mitsuba's frames of
    /// reference.
    Spectrum mirror_matrix([[maybe_unused]] const Vector3f &from, const Vector3f &to) const {
        const Float cos = dr::abs(to.z());
        if constexpr (is_polarized_v<Spectrum>) {
            const dr::Complex<UnpolarizedSpectrum> index(UnpolarizedSpectrum(m_eta), UnpolarizedSpectrum(0.f));
            const Spectrum matrix = mitsuba::mueller::specular_reflection(UnpolarizedSpectrum(cos), index);
            // Axis of the s states, z × `from`; y where `from` is along the normal.
            const Float squared = dr::square(from.x()) + dr::square(from.y());
            const Vector3f s    = dr::select(squared > TANGENT_MIN * TANGENT_MIN,
                                             Vector3f(-from.y(), from.x(), 0.f) *
                                                 dr::rsqrt(dr::maximum(squared, TANGENT_MIN * TANGENT_MIN)),
                                             Vector3f(0.f, 1.f, 0.f));
            return Interface<Float, Spectrum>::in_stokes_bases(matrix, from, s, to, s);
        } else {
            return Spectrum(std::get<0>(mitsuba::fresnel(cos, Float(m_eta))));
        }
    }

    /// Length of a direction's tangential part above which it has an azimuth. Shorter parts count as rounding of the
    /// normal. A smaller bound would take azimuths from rounding, a larger one would ignore true ones.
    static constexpr float TANGENT_MIN = 1e-5f;

    float m_eta;
    bool m_is_film, m_back_reflection;
};

} // namespace sunbeam
