// The BSDF class; the manual is at the top of diffraction.cpp.
#pragma once

#include <algorithm>
#include <optional>
#include <sstream>
#include <tuple>

#include <mitsuba/core/properties.h>
#include <mitsuba/core/warp.h>
#include <mitsuba/render/bsdf.h>
#include <mitsuba/render/ior.h>
#include <mitsuba/render/texture.h>

#include "checks.h"
#include "interface.h"
#include "lobe.h"
#include "parameters.h"
#include "spectral_ends.h"
#include "variants.h"

namespace sunbeam {

using namespace mitsuba;

template <typename Float, typename Spectrum> class Diffraction final : public BSDF<Float, Spectrum> {
public:
    MI_IMPORT_BASE(BSDF, m_flags, m_components)
    MI_IMPORT_TYPES(Texture)

    explicit Diffraction(const Properties &props) : Base(props), m_lobe(new_lobe_surface(props)) {
        m_coherence_length = m_lobe.surface().coherence_length_um();
        parameters_changed();
    }

    void traverse(TraversalCallback *cb) override {
        cb->put("eta", m_eta, ParamFlags::Differentiable | ParamFlags::Discontinuous);
        cb->put("k", m_k, ParamFlags::Differentiable | ParamFlags::Discontinuous);
        cb->put("specular_reflectance", m_specular_reflectance, ParamFlags::Differentiable);
        if (m_diffuse_reflectance)
            cb->put("diffuse_reflectance", m_diffuse_reflectance, ParamFlags::Differentiable);
        cb->put("rotation", m_rotation, ParamFlags::Differentiable | ParamFlags::Discontinuous);
        cb->put("coherence_length", m_coherence_length, ParamFlags::NonDifferentiable);
    }

    void parameters_changed(const std::vector<std::string> &keys = {}) override {
        auto has_changed = [&](const char *key) { return std::find(keys.begin(), keys.end(), key) != keys.end(); };
        if (has_changed("eta") || has_changed("k")) {
            m_perfect = false;
            if (m_reflectance_inside)
                m_lobe = DiffractionLobe<Float, Spectrum>(checked([&] { return m_lobe.surface().without_index(); }));
            m_reflectance_inside = false;
        }
        if (const float built = m_lobe.surface().coherence_length_um(); m_coherence_length != built) {
            const float wanted = m_coherence_length;
            // If it is refused, the BSDF goes on as it was.
            m_coherence_length = built;
            m_lobe             = DiffractionLobe<Float, Spectrum>(
                checked([&] { return m_lobe.surface().with_coherence_length(wanted); }));
            m_coherence_length = wanted;
        }
        m_eta_ends.update(*m_eta);
        m_k_ends.update(*m_k);
        auto varying         = [](const ref<Texture> &texture) { return texture && texture->is_spatially_varying(); };
        uint32_t diffraction = BSDFFlags::GlossyReflection | BSDFFlags::FrontSide | BSDFFlags::Anisotropic;
        if (varying(m_eta) || varying(m_k) || varying(m_specular_reflectance) || varying(m_rotation))
            diffraction = diffraction | BSDFFlags::SpatiallyVarying;
        m_components = { diffraction };
        m_flags      = diffraction;
        if (m_diffuse_reflectance) {
            uint32_t diffuse = BSDFFlags::DiffuseReflection | BSDFFlags::FrontSide;
            if (varying(m_diffuse_reflectance) || varying(m_eta) || varying(m_k) || varying(m_specular_reflectance))
                diffuse = diffuse | BSDFFlags::SpatiallyVarying;
            m_components.push_back(diffuse);
            m_flags = m_flags | diffuse;
        }
    }

    std::pair<BSDFSample3f, Spectrum> sample(const BSDFContext &ctx, const SurfaceInteraction3f &si, Float sample1,
                                             const Point2f &sample2, Mask active) const override {
        MI_MASKED_FUNCTION(ProfilerPhase::BSDFSample, active);
        BSDFSample3f bs = dr::zeros<BSDFSample3f>();
        active &= Frame3f::cos_theta(si.wi) > 0.f;
        const Lobes lobes(*this, ctx);
        if (unlikely(lobes.none() || dr::none_or<false>(active)))
            return { bs, 0.f };

        const Local local      = localise(si, lobes, active);
        const Mask pick_glossy = sample1 < local.prob_diffraction;
        const Float sample_lobe =
            dr::select(pick_glossy, dr::minimum(sample1 / local.prob_diffraction, dr::OneMinusEpsilon<Float>), 0.f);
        const Vector3f wo_glossy = local.to_shading(m_lobe.sample(dr::detach(local.to_grating(si.wi)), si.wavelengths,
                                                                  sample_lobe, sample2, active && pick_glossy));

        // Directions and densities are detached: derivatives are those of the integrand at the places sampled.
        bs.wo  = dr::detach(dr::select(pick_glossy, wo_glossy, warp::square_to_cosine_hemisphere(sample2)));
        bs.eta = 1.f;
        bs.sampled_component = dr::select(pick_glossy, UInt32(0), UInt32(1));
        bs.sampled_type =
            dr::select(pick_glossy, UInt32(+BSDFFlags::GlossyReflection), UInt32(+BSDFFlags::DiffuseReflection));
        active &= Frame3f::cos_theta(bs.wo) > 0.f;

        const auto [value, pdf] = evaluate<true, true>(local, lobes, ctx, si, bs.wo, active);
        active &= pdf > 0.f;
        bs.pdf = dr::select(active, pdf, 0.f);
        return { bs, (dr::select(active, dr::rcp(pdf), 0.f) * value) & active };
    }

    Spectrum eval(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo,
                  Mask active) const override {
        return answer<true, false>(ctx, si, wo, active).first;
    }

    Float pdf(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo, Mask active) const override {
        return answer<false, true>(ctx, si, wo, active).second;
    }

    std::pair<Spectrum, Float> eval_pdf(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo,
                                        Mask active) const override {
        return answer<true, true>(ctx, si, wo, active);
    }

    std::tuple<Spectrum, Float, BSDFSample3f, Spectrum>
    eval_pdf_sample(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo, Float sample1,
                    const Point2f &sample2, Mask active) const override {
        const auto [value, pdf] = eval_pdf(ctx, si, wo, active);
        const auto [bs, weight] = sample(ctx, si, sample1, sample2, active);
        return { value, pdf, bs, weight };
    }

    Spectrum eval_diffuse_reflectance(const SurfaceInteraction3f &si, Mask active) const override {
        if (!m_diffuse_reflectance)
            return 0.f;
        return depolarizer<Spectrum>(m_diffuse_reflectance->eval(si, active));
    }

    std::string to_string() const override {
        std::ostringstream oss;
        oss << "Diffraction[" << std::endl
            << "  surface = " << std_string(m_lobe.surface().describe()) << "," << std::endl
            << "  eta = " << string::indent(m_eta) << "," << std::endl
            << "  k = " << string::indent(m_k) << "," << std::endl
            << "  specular_reflectance = " << string::indent(m_specular_reflectance) << "," << std::endl;
        if (m_diffuse_reflectance)
            oss << "  diffuse_reflectance = " << string::indent(m_diffuse_reflectance) << "," << std::endl;
        oss << "  rotation = " << string::indent(m_rotation) << std::endl << "]";
        return oss.str();
    }

    MI_DECLARE_CLASS(Diffraction)

private:
    /// Which components the caller wants.
    struct Lobes {
        bool diffraction, diffuse;

        Lobes(const Diffraction &bsdf, const BSDFContext &ctx)
            : diffraction(ctx.is_enabled(BSDFFlags::GlossyReflection, 0)),
              diffuse(bsdf.m_diffuse_reflectance && ctx.is_enabled(BSDFFlags::DiffuseReflection, 1)) {}
        bool none() const { return !diffraction && !diffuse; }
    };

    /// The parameters at one point of the surface, and what depends on them and `wi` only.
    struct Local {
        dr::Complex<UnpolarizedSpectrum> ior;
        UnpolarizedSpectrum specular, diffuse;
        Float sin_rotation, cos_rotation;
        /// Probability with which `sample` picks the diffracted lobe.
        Float prob_diffraction;

        Vector3f to_grating(const Vector3f &w) const {
            return { dr::fmadd(cos_rotation, w.x(), sin_rotation * w.y()),
                     dr::fmadd(cos_rotation, w.y(), -sin_rotation * w.x()), w.z() };
        }

        Vector3f to_shading(const Vector3f &w) const {
            return { dr::fmadd(cos_rotation, w.x(), -sin_rotation * w.y()),
                     dr::fmadd(cos_rotation, w.y(), sin_rotation * w.x()), w.z() };
        }

        /// What a facet seen under this angle reflects.
        UnpolarizedSpectrum reflectance(const Float &cos_theta) const {
            return specular * fresnel_conductor(UnpolarizedSpectrum(cos_theta), ior);
        }

        /// What it leaves for the pigment below.
        UnpolarizedSpectrum remainder(const Float &cos_theta) const {
            return dr::maximum(1.f - reflectance(cos_theta), 0.f);
        }
    };

    Local localise(const SurfaceInteraction3f &si, const Lobes &lobes, Mask active) const {
        Local local;
        local.ior      = { m_eta_ends.eval(*m_eta, si, active), m_k_ends.eval(*m_k, si, active) };
        local.specular = m_specular_reflectance->eval(si, active);
        local.diffuse  = lobes.diffuse ? m_diffuse_reflectance->eval(si, active) : UnpolarizedSpectrum(0.f);
        std::tie(local.sin_rotation, local.cos_rotation) = dr::sincos(dr::deg_to_rad(m_rotation->eval_1(si, active)));

        local.prob_diffraction = lobes.diffraction ? 1.f : 0.f;
        if (lobes.diffraction && lobes.diffuse) {
            const Float cos_theta_i = Frame3f::cos_theta(si.wi);
            // Detached: the choice of a lobe is no part of the integrand. Bounded away from 0, so that each lobe is
            // sampled wherever it may contribute.
            const Float glossy     = dr::detach(dr::mean(local.reflectance(cos_theta_i))),
                        rest       = dr::detach(dr::mean(local.diffuse * local.remainder(cos_theta_i)));
            local.prob_diffraction = dr::select(glossy + rest > 0.f, dr::clip(glossy / (glossy + rest), .1f, .9f), .5f);
        }
        return local;
    }

    /// `evaluate` where both directions lie above the surface, zero elsewhere.
    template <bool Value, bool Density> std::pair<Spectrum, Float>
    answer(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo, Mask active) const {
        MI_MASKED_FUNCTION(ProfilerPhase::BSDFEvaluate, active);
        active &= Frame3f::cos_theta(si.wi) > 0.f && Frame3f::cos_theta(wo) > 0.f;
        const Lobes lobes(*this, ctx);
        if (unlikely(lobes.none() || dr::none_or<false>(active)))
            return { 0.f, 0.f };
        const auto [value, pdf] = evaluate<Value, Density>(localise(si, lobes, active), lobes, ctx, si, wo, active);
        return { value & active, dr::select(active, pdf, 0.f) };
    }

    /// Value times cosine, density, or both, of all wanted lobes: the one routine behind eval, pdf, and sample.
    template <bool Value, bool Density>
    std::pair<Spectrum, Float> evaluate(const Local &local, const Lobes &lobes, const BSDFContext &ctx,
                                        const SurfaceInteraction3f &si, const Vector3f &wo, Mask active) const {
        Spectrum value(0.f);
        Float pdf(0.f);
        if (lobes.diffraction) {
            const Vector3f wi_grating = local.to_grating(si.wi), wo_grating = local.to_grating(wo);
            UnpolarizedSpectrum relief(0.f);
            const bool orders_polarise = is_polarized_v<Spectrum> && m_lobe.surface().is_rigorous();
            if (orders_polarise) {
                if constexpr (Value)
                    value = polarised_orders(local, ctx, si, wo, active);
                if constexpr (Density)
                    pdf = m_lobe.pdf(wi_grating, wo_grating, si.wavelengths, active);
            } else if constexpr (Value && Density)
                std::tie(relief, pdf) = m_lobe.eval_pdf(wi_grating, wo_grating, si.wavelengths, active);
            else if constexpr (Value)
                relief = m_lobe.eval(wi_grating, wo_grating, si.wavelengths, active);
            else
                pdf = m_lobe.pdf(wi_grating, wo_grating, si.wavelengths, active);
            if constexpr (Value)
                if (!orders_polarise)
                    value = reflected(local, relief * local.specular, ctx, si.wi, wo);
            pdf *= local.prob_diffraction;
        }
        if (lobes.diffuse) {
            const Float lambertian = warp::square_to_cosine_hemisphere_pdf(wo);
            if constexpr (Value)
                value += depolarizer<Spectrum>(local.diffuse * local.remainder(Frame3f::cos_theta(si.wi)) *
                                               local.remainder(Frame3f::cos_theta(wo)) * lambertian);
            pdf += (1.f - local.prob_diffraction) * lambertian;
        }
        return { value, pdf };
    }

    /// What the orders by Maxwell's equations do to polarised light: zero in variants that carry none.
    Spectrum polarised_orders([[maybe_unused]] const Local &local, [[maybe_unused]] const BSDFContext &ctx,
                              [[maybe_unused]] const SurfaceInteraction3f &si, [[maybe_unused]] const Vector3f &wo,
                              [[maybe_unused]] const Mask &active) const {
        if constexpr (is_polarized_v<Spectrum>) {
            const bool radiance  = ctx.mode == TransportMode::Radiance;
            const Vector3f &from = radiance ? wo : si.wi, &to = radiance ? si.wi : wo;
            const Spectrum matrix =
                m_lobe.matrix(local.to_grating(from), local.to_grating(to), si.wavelengths, active) *
                dr::detach(Frame3f::cos_theta(wo));
            const Vector3f grooves = local.to_shading({ 0.f, 1.f, 0.f });
            auto transverse        = [&](const Vector3f &w) {
                const Vector3f across = dr::fnmadd(w, dr::dot(grooves, w), grooves);
                return across * dr::rsqrt(dr::maximum(dr::squared_norm(across), 1e-12f));
            };
            return local.specular *
                   Interface<Float, Spectrum>::in_stokes_bases(matrix, from, transverse(from), to, transverse(to));
        }
        return Spectrum(0.f);
    }

    /// What becomes of the light that the relief sends from one direction to the other, by what the interface does to
    /// it. It does so with all of that light alike, so nothing is depolarised.
    Spectrum reflected(const Local &local, const UnpolarizedSpectrum &relief, const BSDFContext &ctx,
                       const Vector3f &wi, const Vector3f &wo) const {
        if (m_lobe.surface().is_rigorous())
            return depolarizer<Spectrum>(relief);
        const Interface<Float, Spectrum> interface(local.ior, m_lobe.surface().is_small_slope(), m_perfect);
        if constexpr (is_polarized_v<Spectrum>) {
            const bool radiance   = ctx.mode == TransportMode::Radiance;
            const Spectrum matrix = interface.mueller(radiance ? wo : wi, radiance ? wi : wo);
            if (!m_reflectance_inside)
                return relief * matrix;
            const UnpolarizedSpectrum power = matrix(0, 0);
            return dr::select(power > 0.f, relief / power, 0.f) * matrix;
        } else {
            return m_reflectance_inside ? relief : relief * interface.power(wi, wo);
        }
    }

    /// Sets the textures and builds the surface. Everything is checked before the tables are built, since that takes
    /// seconds.
    rust::Box<Surface> new_lobe_surface(const Properties &props) {
        const std::string json = surface_json(props);
        check_optics(props);
        const std::string material               = material_name(props);
        const std::optional<IndexSpectrum> index = index_spectrum(props, material);
        m_perfect                                = index && index->eta.empty();
        if (material != "none") {
            std::tie(m_eta, m_k) = complex_ior_from_file<Spectrum, Texture>(material);
        } else {
            // eta = 0, k = 1 reflects everything; a given eta without k is a dielectric.
            const bool dielectric = props.has_property("eta");
            m_eta                 = props.get_unbounded_texture<Texture>("eta", 0.f);
            m_k                   = props.get_unbounded_texture<Texture>("k", dielectric ? 0.f : 1.f);
        }
        const IndexSpectrum known = index.value_or(IndexSpectrum());
        const auto source         = [&](const std::string &part) {
            return material == "none" ? "parameter \"" + part + "\"" : part + " of material \"" + material + "\"";
        };
        m_eta_ends.begin(m_eta, source("eta"), known.eta_nm, known.eta);
        m_k_ends.begin(m_k, source("k"), known.k_nm, known.k);
        m_specular_reflectance = props.get_texture<Texture>("specular_reflectance", 1.f);
        m_rotation             = props.get_unbounded_texture<Texture>("rotation", 0.f);
        if (props.has_property("diffuse_reflectance"))
            m_diffuse_reflectance = props.get_texture<Texture>("diffuse_reflectance", 0.f);
        refuse_unknown(props);
        IndexSamples samples;
        samples.known = index.has_value();
        if (index) {
            auto copy = [](const std::vector<double> &from, rust::Vec<double> &to) {
                for (double value : from)
                    to.push_back(value);
            };
            copy(index->eta_nm, samples.eta_nm);
            copy(index->eta, samples.eta);
            copy(index->k_nm, samples.k_nm);
            copy(index->k, samples.k);
        }
        return checked([&] {
            constexpr bool polarised   = is_polarized_v<Spectrum>;
            rust::Box<Surface> surface = is_spectral_v<Spectrum>
                                             ? new_surface(rust_str(json), samples, polarised)
                                             : new_colour_surface(rust_str(json), samples, polarised);
            // The small slope's factor of a perfect conductor is not in colours, which have no index to be for.
            m_reflectance_inside = surface->is_rigorous() || (!is_spectral_v<Spectrum> && samples.known &&
                                                              !(m_perfect && surface->is_small_slope()));
            return surface;
        });
    }

    /// What Rust answers; what it refuses becomes an error of Mitsuba's.
    template <typename Call> static auto checked(const Call &call) -> decltype(call()) {
        try {
            return call();
        } catch (const std::exception &error) {
            Throw("%s", error.what());
        }
    }

    ref<Texture> m_eta, m_k, m_specular_reflectance, m_diffuse_reflectance, m_rotation;
    SpectralEnds<Float, Spectrum> m_eta_ends, m_k_ends;
    float m_coherence_length = 0.f;
    /// Whether the lobe's values contain what the interface does to light: in variants that carry colours, until `eta`
    /// or `k` change, if these have wavelengths.
    bool m_reflectance_inside = false;
    /// Whether everything is reflected, until `eta` or `k` change.
    bool m_perfect = false;
    // The last member, because `new_lobe_surface` sets the others before it is made.
    DiffractionLobe<Float, Spectrum> m_lobe;

    MI_TRAVERSE_CB(Base, m_eta, m_k, m_specular_reflectance, m_diffuse_reflectance, m_rotation, m_eta_ends, m_k_ends,
                   m_lobe)
};

/// Tells Mitsuba how to make an instance of one variant; returns 1, for counting.
template <typename Float, typename Spectrum> size_t register_variant(std::string_view name, PluginRegisterFn fn) {
    using Class = Diffraction<Float, Spectrum>;
    fn(name, Class::Variant, Class::Type, [](void *, const Properties &props) -> ref<Object> {
        // Here and not when the plugin is loaded, so that every attempt is told the reason.
        require_compatible(mitsuba_address);
        return new Class(props);
    });
    return 1;
}

} // namespace sunbeam
