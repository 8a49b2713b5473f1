// Optics of one BSDF instance: its textures and tables, and the answers computed from them.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <mitsuba/core/properties.h>
#include <mitsuba/core/warp.h>
#include <mitsuba/render/bsdf.h>
#include <mitsuba/render/ior.h>
#include <mitsuba/render/texture.h>

#include "compat.h"
#include "fingerprint.h"
#include "interface.h"
#include "lobe.h"
#include "parameters.h"
#include "spectral_ends.h"

namespace sunbeam {

using namespace mitsuba;

/// Textures and tables of one instance. Objects are never modified, so a thread can go on tracing one while another
/// thread changes or deletes the instance. Mitsuba alone changes values inside the textures.
template <typename Float, typename Spectrum> class Optics {
public:
    MI_IMPORT_TYPES(Texture)
    using Lobe = DiffractionLobe<Float, Spectrum>;

    explicit Optics(const Properties &props) : m_lobe(std::make_shared<const Lobe>(new_lobe_surface(props))) {
        auto varying         = [](const ref<Texture> &texture) { return texture && texture->is_spatially_varying(); };
        uint32_t diffraction = BSDFFlags::GlossyReflection | BSDFFlags::FrontSide | BSDFFlags::Anisotropic;
        if (varying(m_eta) || varying(m_k) || varying(m_specular_reflectance) || varying(m_rotation))
            diffraction = diffraction | BSDFFlags::SpatiallyVarying;
        m_components = { diffraction };
        if (m_diffuse_reflectance) {
            uint32_t diffuse = BSDFFlags::DiffuseReflection | BSDFFlags::FrontSide;
            if (varying(m_diffuse_reflectance) || varying(m_eta) || varying(m_k) || varying(m_specular_reflectance))
                diffuse = diffuse | BSDFFlags::SpatiallyVarying;
            m_components.push_back(diffuse);
        }
    }

    /// A copy with tables for another coherence length in µm.
    Optics with_coherence_length(float coherence_length_um) const {
        auto surface = checked([&] { return m_lobe->surface().with_coherence_length(coherence_length_um); });
        Optics optics(*this);
        optics.set_lobe(std::make_shared<const Lobe>(std::move(surface)));
        return optics;
    }

    /// A copy whose reflectance follows the textures `eta` and `k`, instead of an index that the tables include.
    Optics without_index() const {
        Optics optics(*this);
        optics.m_perfect            = false;
        optics.m_interface_included = false;
        auto surface                = [&] { return m_lobe->surface().without_index(); };
        optics.set_lobe(m_interface_included ? std::make_shared<const Lobe>(checked(surface)) : m_lobe);
        return optics;
    }

    /// A copy that continues the spectra of `eta` and `k` from their present ends.
    Optics with_present_ends() const {
        Optics optics(*this);
        optics.m_eta_ends.update(*optics.m_eta);
        optics.m_k_ends.update(*optics.m_k);
        optics.m_fingerprint = FrozenAs(optics.code());
        return optics;
    }

    /// The flags of each component.
    const std::vector<uint32_t> &components() const { return m_components; }

    /// The coherence length in µm.
    float coherence_length_um() const { return m_lobe->surface().coherence_length_um(); }

    /// Shows Mitsuba the parameters that can change.
    void traverse(TraversalCallback *cb) const {
        auto put = [&](const char *name, ref<Texture> texture, auto flags) { cb->put(name, texture, flags); };
        put("eta", m_eta, ParamFlags::Differentiable | ParamFlags::Discontinuous);
        put("k", m_k, ParamFlags::Differentiable | ParamFlags::Discontinuous);
        put("specular_reflectance", m_specular_reflectance, ParamFlags::Differentiable);
        if (m_diffuse_reflectance)
            put("diffuse_reflectance", m_diffuse_reflectance, ParamFlags::Differentiable);
        put("rotation", m_rotation, ParamFlags::Differentiable | ParamFlags::Discontinuous);
    }

    /// Shows frozen functions the variables of textures and tables, and a fingerprint of the traced code.
    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro fn) const {
        each_traversable([&](auto part) { dr::traverse_1_fn_ro(part, payload, fn); });
    }
    void traverse_1_cb_rw(void *payload, dr::detail::traverse_callback_rw fn) const {
        each_traversable([&](auto part) { dr::traverse_1_fn_rw(part, payload, fn); });
    }

    std::pair<BSDFSample3f, Spectrum> sample(const BSDFContext &ctx, const SurfaceInteraction3f &si, Float sample1,
                                             const Point2f &sample2, Mask active) const {
        BSDFSample3f bs = dr::zeros<BSDFSample3f>();
        active &= Frame3f::cos_theta(si.wi) > 0.f;
        const Lobes lobes(*this, ctx);
        if (unlikely(lobes.none() || dr::none_or<false>(active)))
            return { bs, 0.f };

        const Local local      = localise(si, lobes, active);
        const Mask pick_glossy = sample1 < local.prob_diffraction;
        const Float sample_lobe =
            dr::select(pick_glossy, dr::minimum(sample1 / local.prob_diffraction, dr::OneMinusEpsilon<Float>), 0.f);
        const Vector3f wo_glossy = local.to_shading(m_lobe->sample(dr::detach(local.to_grating(si.wi)), si.wavelengths,
                                                                   sample_lobe, sample2, active && pick_glossy));

        // Directions and densities are detached: derivatives are those of the integrand at the sampled directions.
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

    /// Value times cosθo, density in 1/sr, or both. Zero where a direction lies below the surface.
    template <bool Value, bool Density> std::pair<Spectrum, Float>
    answer(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo, Mask active) const {
        active &= Frame3f::cos_theta(si.wi) > 0.f && Frame3f::cos_theta(wo) > 0.f;
        const Lobes lobes(*this, ctx);
        if (unlikely(lobes.none() || dr::none_or<false>(active)))
            return { 0.f, 0.f };
        const auto [value, pdf] = evaluate<Value, Density>(localise(si, lobes, active), lobes, ctx, si, wo, active);
        return { value & active, dr::select(active, pdf, 0.f) };
    }

    Spectrum eval_diffuse_reflectance(const SurfaceInteraction3f &si, Mask active) const {
        if (!m_diffuse_reflectance)
            return 0.f;
        return depolarizer<Spectrum>(m_diffuse_reflectance->eval(si, active));
    }

    std::string to_string() const {
        std::ostringstream oss;
        oss << "Diffraction[" << std::endl
            << "  surface = " << std_string(m_lobe->surface().describe()) << "," << std::endl
            << "  eta = " << string::indent(m_eta) << "," << std::endl
            << "  k = " << string::indent(m_k) << "," << std::endl
            << "  specular_reflectance = " << string::indent(m_specular_reflectance) << "," << std::endl;
        if (m_diffuse_reflectance)
            oss << "  diffuse_reflectance = " << string::indent(m_diffuse_reflectance) << "," << std::endl;
        oss << "  rotation = " << string::indent(m_rotation) << std::endl << "]";
        return oss.str();
    }

private:
    /// Empty stand-in for scalar variants, which trace no code.
    struct NoFingerprint {
        explicit NoFingerprint(uint64_t) {}
    };
    using FrozenAs = std::conditional_t<dr::is_jit_v<Float>, Fingerprint<Float>, NoFingerprint>;

    /// Components that the caller's context enables.
    struct Lobes {
        bool diffraction, diffuse;

        Lobes(const Optics &optics, const BSDFContext &ctx)
            : diffraction(ctx.is_enabled(BSDFFlags::GlossyReflection, 0)),
              diffuse(optics.m_diffuse_reflectance && ctx.is_enabled(BSDFFlags::DiffuseReflection, 1)) {}
        bool none() const { return !diffraction && !diffuse; }
    };

    /// Parameters at one point of the surface, and quantities that depend on them and `wi` alone.
    struct Local {
        dr::Complex<UnpolarizedSpectrum> ior;
        UnpolarizedSpectrum specular, diffuse;
        Float sin_rotation, cos_rotation;
        /// Probability that `sample` picks the diffracted lobe.
        Float prob_diffraction;

        Vector3f to_grating(const Vector3f &w) const {
            return { dr::fmadd(cos_rotation, w.x(), sin_rotation * w.y()),
                     dr::fmadd(cos_rotation, w.y(), -sin_rotation * w.x()), w.z() };
        }

        Vector3f to_shading(const Vector3f &w) const {
            return { dr::fmadd(cos_rotation, w.x(), -sin_rotation * w.y()),
                     dr::fmadd(cos_rotation, w.y(), sin_rotation * w.x()), w.z() };
        }

        /// Fresnel reflectance of a facet at this cosine, times `specular_reflectance`.
        UnpolarizedSpectrum reflectance(const Float &cos_theta) const {
            return specular * fresnel_conductor(UnpolarizedSpectrum(cos_theta), ior);
        }

        /// Fraction of the light that passes the facet to the pigment below.
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
            // Detached: the choice of a lobe is no part of the integrand. Between 0.1 and 0.9, so that each lobe is
            // sampled wherever it contributes, with a weight of at most ten times its own.
            const Float glossy     = dr::detach(dr::mean(local.reflectance(cos_theta_i))),
                        rest       = dr::detach(dr::mean(local.diffuse * local.remainder(cos_theta_i)));
            local.prob_diffraction = dr::select(glossy + rest > 0.f, dr::clip(glossy / (glossy + rest), .1f, .9f), .5f);
        }
        return local;
    }

    /// Value times cosθo, density, or both, summed over the enabled components. eval, pdf and sample all call it.
    template <bool Value, bool Density>
    std::pair<Spectrum, Float> evaluate(const Local &local, const Lobes &lobes, const BSDFContext &ctx,
                                        const SurfaceInteraction3f &si, const Vector3f &wo, Mask active) const {
        Spectrum value(0.f);
        Float pdf(0.f);
        if (lobes.diffraction) {
            const Vector3f wi_grating = local.to_grating(si.wi), wo_grating = local.to_grating(wo);
            UnpolarizedSpectrum relief(0.f);
            const bool orders_polarise = is_polarized_v<Spectrum> && m_lobe->surface().is_rigorous();
            if (orders_polarise) {
                if constexpr (Value)
                    value = polarised_orders(local, ctx, si, wo, active);
                if constexpr (Density)
                    pdf = m_lobe->pdf(wi_grating, wo_grating, si.wavelengths, active);
            } else if constexpr (Value && Density)
                std::tie(relief, pdf) = m_lobe->eval_pdf(wi_grating, wo_grating, si.wavelengths, active);
            else if constexpr (Value)
                relief = m_lobe->eval(wi_grating, wo_grating, si.wavelengths, active);
            else
                pdf = m_lobe->pdf(wi_grating, wo_grating, si.wavelengths, active);
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

    /// Mueller matrix of the rigorous theory's orders, times cosθo. Zero in unpolarised variants.
    Spectrum polarised_orders([[maybe_unused]] const Local &local, [[maybe_unused]] const BSDFContext &ctx,
                              [[maybe_unused]] const SurfaceInteraction3f &si, [[maybe_unused]] const Vector3f &wo,
                              [[maybe_unused]] const Mask &active) const {
        if constexpr (is_polarized_v<Spectrum>) {
            const bool radiance  = ctx.mode == TransportMode::Radiance;
            const Vector3f &from = radiance ? wo : si.wi, &to = radiance ? si.wi : wo;
            const Spectrum matrix =
                m_lobe->matrix(local.to_grating(from), local.to_grating(to), si.wavelengths, active) *
                dr::detach(Frame3f::cos_theta(wo));
            const Vector3f grooves = local.to_shading({ 0.f, 1.f, 0.f });
            auto transverse        = [&](const Vector3f &w) {
                const Vector3f axis = dr::fnmadd(w, dr::dot(grooves, w), grooves);
                return axis * dr::rsqrt(dr::maximum(dr::squared_norm(axis), 1e-12f));
            };
            return local.specular *
                   Interface<Float, Spectrum>::in_stokes_bases(matrix, from, transverse(from), to, transverse(to));
        }
        return Spectrum(0.f);
    }

    /// The relief's answer times the interface's factor or Mueller matrix. One matrix applies to all diffracted light,
    /// so nothing is depolarised.
    Spectrum reflected(const Local &local, const UnpolarizedSpectrum &relief, const BSDFContext &ctx,
                       const Vector3f &wi, const Vector3f &wo) const {
        if (m_lobe->surface().is_rigorous())
            return depolarizer<Spectrum>(relief);
        const Interface<Float, Spectrum> interface(local.ior, m_lobe->surface().is_small_slope(), m_perfect);
        if constexpr (is_polarized_v<Spectrum>) {
            const bool radiance   = ctx.mode == TransportMode::Radiance;
            const Spectrum matrix = interface.mueller(radiance ? wo : wi, radiance ? wi : wo);
            if (!m_interface_included)
                return relief * matrix;
            const UnpolarizedSpectrum power = matrix(0, 0);
            return dr::select(power > 0.f, relief / power, 0.f) * matrix;
        } else {
            return m_interface_included ? relief : relief * interface.power(wi, wo);
        }
    }

    /// Sets the textures and builds the surface. Parameters are checked before the tables are built, which takes
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
            // Colour tables include the factor of an index. A perfect conductor has none, so its small-slope factor is
            // computed here.
            m_interface_included = surface->is_rigorous() || (!is_spectral_v<Spectrum> && samples.known &&
                                                              !(m_perfect && surface->is_small_slope()));
            return surface;
        });
    }

    /// Calls Rust and rethrows its errors as Mitsuba's.
    template <typename Call> static auto checked(const Call &call) -> decltype(call()) {
        try {
            return call();
        } catch (const std::exception &error) {
            Throw("%s", error.what());
        }
    }

    void set_lobe(std::shared_ptr<const Lobe> lobe) {
        m_lobe        = std::move(lobe);
        m_fingerprint = FrozenAs(code());
    }

    /// Hash of all choices that change the traced code.
    uint64_t code() const {
        const Surface &surface = m_lobe->surface();
        uint64_t code          = surface.identity();
        for (bool choice : { m_interface_included, m_perfect, surface.is_small_slope(), bool(m_diffuse_reflectance),
                             m_eta_ends.are_clipped(), m_k_ends.are_clipped() })
            code = 2 * code + choice;
        return code;
    }

    template <typename Visit> void each_traversable(const Visit &visit) const {
        visit(m_eta);
        visit(m_k);
        visit(&m_eta_ends);
        visit(&m_k_ends);
        visit(m_specular_reflectance);
        visit(m_diffuse_reflectance);
        visit(m_rotation);
        visit(m_lobe);
        visit(m_fingerprint);
    }

    ref<Texture> m_eta, m_k, m_specular_reflectance, m_diffuse_reflectance, m_rotation;
    SpectralEnds<Float, Spectrum> m_eta_ends, m_k_ends;
    std::vector<uint32_t> m_components;
    /// Whether the lobe's values include the interface's factor. True in RGB and mono variants while `eta` and `k` are
    /// the spectra that the tables were built with, and for the rigorous theory.
    bool m_interface_included = false;
    /// Whether the surface is a perfect reflector; false once `eta` or `k` change.
    bool m_perfect = false;
    // Declared after the textures: `new_lobe_surface` sets these while it initialises `m_lobe`.
    std::shared_ptr<const Lobe> m_lobe;
    FrozenAs m_fingerprint{ code() };
};

} // namespace sunbeam
