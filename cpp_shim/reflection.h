// Optics of a surface that only reflects: the diffracted light, a pigment below the relief, and a cover above it. The
// lobe in Rust (lobe.h) has the value of the bare relief.
#pragma once

#include <utility>
#include <vector>

#include <mitsuba/core/warp.h>
#include <mitsuba/render/bsdf.h>

#include "cover.h"
#include "interface.h"
#include "lobe.h"
#include "rotation.h"
#include "textures.h"

namespace sunbeam {

/// Reflection by a relief under an optional cover, with an optional diffuse pigment below the relief.
///
/// This class adds the rotation, the interface's factor (Fresnel or small slope, interface.h), the cover (a clear
/// layer, cover.h) and the pigment to the lobe's value. `sample` chooses among the components: the diffracted light,
/// the pigment, and the cover's mirror reflection (here the *mirror*).
///
/// Directions `wi` and `wo` are unit vectors in the shading frame and point away from the surface.
template <typename Float, typename Spectrum> class Reflection {
public:
    MI_IMPORT_TYPES(Texture)
    using Lobe = DiffractionLobe<Float, Spectrum>;

    /// Whether the lobe's values need no further interface's factor; set by optics.h. True for the rigorous theory. In
    /// RGB and mono variants also true while `eta` and `k` are those that the tables were built with, except for the
    /// small-slope factor of a perfect conductor.
    bool interface_included = false;
    /// Whether the surface is a perfect reflector; false after `eta` or `k` have changed.
    bool perfect = false;

    /// A relief under a cover of index `cover_eta`, 1 for none. Without `cover_reflection`, the mirror reflection by
    /// the cover is left out.
    Reflection(float cover_eta, bool cover_reflection)
        : m_cover(cover_eta), m_cover_reflection(cover_reflection && m_cover.exists()) {}

    /// `BSDFFlags` of each component: the diffracted light, the pigment if there is one, and the cover's mirror if
    /// there is one.
    std::vector<uint32_t> components(const Textures<Float, Spectrum> &textures) const {
        uint32_t diffraction = BSDFFlags::GlossyReflection | BSDFFlags::FrontSide | BSDFFlags::Anisotropic;
        if (textures.diffraction_varies())
            diffraction = diffraction | BSDFFlags::SpatiallyVarying;
        std::vector<uint32_t> components = { diffraction };
        if (textures.diffuse_reflectance) {
            uint32_t diffuse = BSDFFlags::DiffuseReflection | BSDFFlags::FrontSide;
            if (textures.pigment_varies())
                diffuse = diffuse | BSDFFlags::SpatiallyVarying;
            components.push_back(diffuse);
        }
        if (m_cover_reflection)
            components.push_back(BSDFFlags::DeltaReflection | BSDFFlags::FrontSide);
        return components;
    }

    /// Whether the cover's mirror reflection is a component.
    bool reflects_at_cover() const { return m_cover_reflection; }

    /// A direction, and its value times cosθo over its density. `sample1` chooses the component, then serves as the
    /// first of three variates in the diffracted lobe. The cover's mirror has a probability in place of a density.
    std::pair<BSDFSample3f, Spectrum> sample(const Lobe &lobe, const Textures<Float, Spectrum> &textures,
                                             const BSDFContext &ctx, const SurfaceInteraction3f &si, Float sample1,
                                             const Point2f &sample2, Mask active) const {
        BSDFSample3f bs = dr::zeros<BSDFSample3f>();
        active &= Frame3f::cos_theta(si.wi) > 0.f;
        const Enabled enabled(*this, textures, ctx);
        if (unlikely(enabled.none() || dr::none_or<false>(active)))
            return { bs, 0.f };

        const SurfacePoint point = surface_point(textures, si, enabled, active);
        const Mask pick_cover    = sample1 < point.prob_cover;
        // Uniform in [0, 1) again, given that the mirror is not picked.
        if (enabled.cover)
            sample1 = dr::clip((sample1 - point.prob_cover) / dr::maximum(1.f - point.prob_cover, dr::Epsilon<Float>),
                               0.f, dr::OneMinusEpsilon<Float>);
        const Mask pick_diffraction = sample1 < point.prob_diffraction;
        // Uniform in [0, 1) again, given that the diffracted lobe is picked.
        const Float sample_diffraction = dr::select(
            pick_diffraction, dr::minimum(sample1 / point.prob_diffraction, dr::OneMinusEpsilon<Float>), 0.f);
        const Vector3f wo_diffraction =
            point.to_shading(lobe.sample(dr::detach(point.to_relief(si.wi)), si.wavelengths, point.size,
                                         sample_diffraction, sample2, active && pick_diffraction));

        // Directions and densities are detached: derivatives are those of the integrand at the sampled directions.
        bs.wo  = dr::detach(dr::select(pick_diffraction, wo_diffraction, warp::square_to_cosine_hemisphere(sample2)));
        bs.eta = 1.f;
        bs.sampled_component = dr::select(pick_diffraction, UInt32(DIFFRACTION), UInt32(PIGMENT));
        bs.sampled_type =
            dr::select(pick_diffraction, UInt32(+BSDFFlags::GlossyReflection), UInt32(+BSDFFlags::DiffuseReflection));
        // The cover's mirror needs only `wi` above the surface, the other components need `wo` above it, too.
        const Mask above = active;
        active &= Frame3f::cos_theta(bs.wo) > 0.f && !pick_cover;

        const auto [value, pdf] = evaluate<true, true>(lobe, point, enabled, ctx, si, bs.wo, active);
        active &= pdf > 0.f;
        bs.pdf          = dr::select(active, pdf, 0.f);
        Spectrum weight = (dr::select(active, dr::rcp(pdf), 0.f) * value) & active;
        if (enabled.cover) {
            // In the radiance mode light travels from `wo` to `wi`, in the importance mode from `wi` to `wo`.
            const bool radiance            = ctx.mode == TransportMode::Radiance;
            const Vector3f mirror          = reflect(si.wi);
            const Spectrum mirrored        = m_cover.mirror(radiance ? mirror : si.wi, radiance ? si.wi : mirror);
            dr::masked(bs.wo, pick_cover)  = dr::detach(mirror);
            dr::masked(bs.pdf, pick_cover) = dr::select(above, point.prob_cover, 0.f);
            dr::masked(bs.sampled_component, pick_cover) = cover_component(textures);
            dr::masked(bs.sampled_type, pick_cover)      = UInt32(+BSDFFlags::DeltaReflection);
            weight = dr::select(pick_cover, (mirrored / point.prob_cover) & (above && point.prob_cover > 0.f), weight);
        }
        return { bs, weight };
    }

    /// BSDF times cosθo, and density in 1/sr with which `sample` draws `wo`, over the enabled components. A part whose
    /// template argument is false has no meaning. Both are zero where a direction lies below the surface.
    template <bool Value, bool Density>
    std::pair<Spectrum, Float> answer(const Lobe &lobe, const Textures<Float, Spectrum> &textures,
                                      const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo,
                                      Mask active) const {
        active &= Frame3f::cos_theta(si.wi) > 0.f && Frame3f::cos_theta(wo) > 0.f;
        const Enabled enabled(*this, textures, ctx);
        if (unlikely(enabled.none() || dr::none_or<false>(active)))
            return { 0.f, 0.f };
        const auto [value, pdf] =
            evaluate<Value, Density>(lobe, surface_point(textures, si, enabled, active), enabled, ctx, si, wo, active);
        return { value & active, dr::select(active, pdf, 0.f) };
    }

private:
    /// Numbers of the components; the cover's mirror is the last.
    static constexpr uint32_t DIFFRACTION = 0, PIGMENT = 1;
    static uint32_t cover_component(const Textures<Float, Spectrum> &textures) {
        return textures.diffuse_reflectance ? 2 : 1;
    }

    /// Whether each component exists and is enabled by the caller's context.
    struct Enabled {
        bool diffraction, pigment, cover;

        Enabled(const Reflection &reflection, const Textures<Float, Spectrum> &textures, const BSDFContext &ctx)
            : diffraction(ctx.is_enabled(BSDFFlags::GlossyReflection, DIFFRACTION)),
              pigment(textures.diffuse_reflectance && ctx.is_enabled(BSDFFlags::DiffuseReflection, PIGMENT)),
              cover(reflection.m_cover_reflection &&
                    ctx.is_enabled(BSDFFlags::DeltaReflection, cover_component(textures))) {}
        bool none() const { return !diffraction && !pigment && !cover; }
    };

    /// Parameters at one point of the surface, and quantities that depend only on them and `wi`.
    struct SurfacePoint {
        /// Refractive index eta + ik, relative to the cover's.
        dr::Complex<UnpolarizedSpectrum> ior;
        /// Values of `specular_reflectance` and `diffuse_reflectance`.
        UnpolarizedSpectrum specular, diffuse;
        /// Size of pattern and heights relative to the relief; 1 without textures of sizes.
        typename Lobe::Size size;
        /// Rotation of the relief about the normal.
        Rotation<Float> rotation;
        /// Probability that `sample` picks the cover's mirror, and that it picks the diffracted lobe otherwise.
        Float prob_cover, prob_diffraction;
        Cover<Float, Spectrum> cover;
        /// Whether the surface is a perfect reflector.
        bool perfect;

        SurfacePoint(const Cover<Float, Spectrum> &cover, bool perfect) : cover(cover), perfect(perfect) {}

        /// Direction `outside` of the shading frame, in the relief's frame and inside the cover.
        Vector3f to_relief(const Vector3f &outside) const { return rotation.to_relief(cover.inside(outside)); }

        /// Direction `w` of the relief's frame, inside the cover, in the shading frame and outside. The zero vector for
        /// light that the cover reflects totally.
        Vector3f to_shading(const Vector3f &w) const { return rotation.to_shading(cover.outside(w)); }

        /// Fresnel reflectance at an angle of incidence with this cosine, times `specular_reflectance`.
        UnpolarizedSpectrum reflectance(const Float &cos_theta) const {
            return specular * Interface<Float, Spectrum>::reflectance(cos_theta, ior, perfect);
        }

        /// Fraction of the light that passes the surface to or from the pigment below, at an angle with this cosine.
        UnpolarizedSpectrum remainder(const Float &cos_theta) const {
            return dr::maximum(1.f - reflectance(cos_theta), 0.f);
        }
    };

    /// Evaluates the textures at the point of `si`, and the probabilities of the components there.
    SurfacePoint surface_point(const Textures<Float, Spectrum> &textures, const SurfaceInteraction3f &si,
                               const Enabled &enabled, Mask active) const {
        SurfacePoint point(m_cover, perfect);

        // Beyond the ends of their spectra, eta and k keep the values at the ends (spectral_ends.h).
        point.ior      = { textures.eta_ends.eval(*textures.eta, si, active) / m_cover.eta(),
                           textures.k_ends.eval(*textures.k, si, active) / m_cover.eta() };
        point.specular = textures.specular_reflectance->eval(si, active);
        point.diffuse  = enabled.pigment ? textures.diffuse_reflectance->eval(si, active) : UnpolarizedSpectrum(0.f);
        point.rotation = Rotation<Float>::degrees(textures.rotation->eval_1(si, active));
        point.size     = textures.size(si, active);

        const Float cos_theta_i = Frame3f::cos_theta(m_cover.inside(si.wi));
        point.prob_diffraction  = enabled.diffraction ? 1.f : 0.f;
        if (enabled.diffraction && enabled.pigment) {
            // In proportion to estimates of the albedos of relief and pigment. Detached, because the choice of a
            // component is no part of the integrand. Limited to 0.1 to 0.9, so that a sample's weight is at most ten
            // times that of sampling its lobe alone. A wider range would follow the albedos more closely and allow
            // larger weights.
            const Float diffracted = dr::detach(dr::mean(point.reflectance(cos_theta_i))),
                        pigment    = dr::detach(dr::mean(point.diffuse * point.remainder(cos_theta_i)));
            const Float both       = diffracted + pigment;
            point.prob_diffraction = dr::select(both > 0.f, dr::clip(diffracted / both, .1f, .9f), .5f);
        }
        point.prob_cover = enabled.cover ? 1.f : 0.f;
        if (enabled.cover && (enabled.diffraction || enabled.pigment)) {
            const Float mirrored = dr::detach(m_cover.reflectance(Frame3f::cos_theta(si.wi)));
            // In proportion to the mirror's reflectance and an estimate of the light from below the cover. The lower
            // bound 0.2 limits the weights of the other components' samples, transmittance included, to five times
            // those without a cover. A smaller one would give the mirror more samples on dark surfaces.
            const Float passed = dr::detach(dr::mean(point.reflectance(cos_theta_i) + point.diffuse));
            point.prob_cover   = mirrored / (mirrored + (1.f - mirrored) * dr::clip(passed, .2f, 1.f));
        }
        return point;
    }

    /// BSDF times cosθo, and density in 1/sr, summed over the enabled components. A part whose template argument is
    /// false has no meaning. Both directions are above the surface where `active` is true.
    template <bool Value, bool Density>
    std::pair<Spectrum, Float> evaluate(const Lobe &lobe, const SurfacePoint &point, const Enabled &enabled,
                                        const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo,
                                        Mask active) const {
        Spectrum value(0.f);
        Float pdf(0.f);
        if (enabled.diffraction) {
            const Vector3f wi_relief = point.to_relief(si.wi), wo_relief = point.to_relief(wo);
            // Converts densities, and values times cosines, from solid angles inside the cover to those outside. For
            // values it includes the division by n², the change of radiance where light leaves the cover.
            const Float ratio = dr::detach(m_cover.solid_angle_ratio(wo));
            if (is_polarized_v<Spectrum> && lobe.surface().is_rigorous()) {
                if constexpr (Value)
                    value = polarised_orders(lobe, point, ctx, si, wo, active);
                if constexpr (Density)
                    pdf = lobe.pdf(wi_relief, wo_relief, si.wavelengths, point.size, active);
            } else {
                const auto [relief, density] =
                    lobe.template answer<Value, Density>(wi_relief, wo_relief, si.wavelengths, point.size, active);
                pdf = density;
                if constexpr (Value)
                    value = reflected(lobe, point, relief * point.specular * ratio, ctx, si.wi, wo);
            }
            pdf *= point.prob_diffraction * ratio;
        }
        if (enabled.pigment) {
            // cosθo / π: the density of the pigment's samples, and the value times cosθo of a white pigment. Radiance
            // inside a cover of index n is n² times that outside, hence the division by n² below.
            const Float lambertian = warp::square_to_cosine_hemisphere_pdf(wo);
            if constexpr (Value)
                value +=
                    depolarizer<Spectrum>(point.diffuse * point.remainder(Frame3f::cos_theta(m_cover.inside(si.wi))) *
                                          point.remainder(Frame3f::cos_theta(m_cover.inside(wo))) *
                                          (lambertian * m_cover.transmittance(si.wi, wo) / dr::square(m_cover.eta())));
            pdf += (1.f - point.prob_diffraction) * lambertian;
        }
        return { value, pdf * (1.f - point.prob_cover) };
    }

    /// Mueller matrix of a rigorous surface, summed over its orders, times cosθo and between Mitsuba's frames of
    /// reference. The lobe's matrix is between frames with the grooves as first axis. Zero in unpolarised variants.
    Spectrum polarised_orders([[maybe_unused]] const Lobe &lobe, [[maybe_unused]] const SurfacePoint &point,
                              [[maybe_unused]] const BSDFContext &ctx, [[maybe_unused]] const SurfaceInteraction3f &si,
                              [[maybe_unused]] const Vector3f &wo, [[maybe_unused]] const Mask &active) const {
        if constexpr (is_polarized_v<Spectrum>) {
            // Paths that carry radiance are traced from the camera, against the light.
            const bool radiance  = ctx.mode == TransportMode::Radiance;
            const Vector3f &from = radiance ? wo : si.wi, &to = radiance ? si.wi : wo;
            // The BSDF outside is that inside over n², because radiance inside the cover is n² times that outside.
            const Float factor = dr::detach(Frame3f::cos_theta(wo)) / dr::square(m_cover.eta());
            const Spectrum matrix =
                lobe.matrix(point.to_relief(from), point.to_relief(to), si.wavelengths, active) * factor;
            const Vector3f from_in = m_cover.inside(from), to_in = m_cover.inside(to);
            return point.specular * m_cover.through(Interface<Float, Spectrum>::in_stokes_bases(
                                                        matrix, from_in, point.rotation.groove_axis(from_in), to_in,
                                                        point.rotation.groove_axis(to_in)),
                                                    from, to);
        }
        return Spectrum(0.f);
    }

    /// `relief` times the interface's factor, or in polarised variants times its Mueller matrix. `relief` is the lobe's
    /// value times cosθo, outside the cover. One matrix applies to all diffracted light, so nothing is depolarised.
    Spectrum reflected(const Lobe &lobe, const SurfacePoint &point, const UnpolarizedSpectrum &relief,
                       const BSDFContext &ctx, const Vector3f &wi, const Vector3f &wo) const {
        // Only unpolarised variants get here with a rigorous surface. Its values include the material.
        if (lobe.surface().is_rigorous())
            return depolarizer<Spectrum>(relief * m_cover.transmittance(wi, wo));
        const Vector3f wi_in = m_cover.inside(wi), wo_in = m_cover.inside(wo);
        const Interface<Float, Spectrum> interface(point.ior, lobe.surface().is_small_slope(), point.perfect);
        if constexpr (is_polarized_v<Spectrum>) {
            const bool radiance = ctx.mode == TransportMode::Radiance;
            Spectrum matrix     = interface.mueller(radiance ? wo_in : wi_in, radiance ? wi_in : wo_in);
            if (interface_included) {
                // The lobe's value includes the factor for unpolarised light, which is the first element.
                const UnpolarizedSpectrum power = matrix(0, 0);
                matrix                          = dr::select(power > 0.f, relief / power, 0.f) * matrix;
            } else {
                matrix = relief * matrix;
            }
            return m_cover.through(matrix, radiance ? wo : wi, radiance ? wi : wo);
        } else {
            const UnpolarizedSpectrum passed = relief * m_cover.transmittance(wi, wo);
            return interface_included ? passed : passed * interface.power(wi_in, wo_in);
        }
    }

    Cover<Float, Spectrum> m_cover;
    /// Whether the cover's mirror reflection is a component; false without a cover.
    bool m_cover_reflection;
};

} // namespace sunbeam
