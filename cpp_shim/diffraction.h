// The BSDF class; the manual is at the top of diffraction.cpp.
#pragma once

#include <algorithm>
#include <memory>

#include "checks.h"
#include "optics.h"
#include "variants.h"

namespace sunbeam {

/// Optics of an instance, in a base class that is constructed before Mitsuba's BSDF and destroyed after it.
///
/// BSDF's constructor enters the instance in Dr.Jit's registry, and its destructor removes it. A thread that traces a
/// scene calls every BSDF in the registry, including those of other threads' scenes. Therefore the optics exist at
/// least as long as the entry.
template <typename Float, typename Spectrum> class OpticsHolder {
protected:
    using Held = const Optics<Float, Spectrum>;

    explicit OpticsHolder(const Properties &props) : m_optics(std::make_shared<Held>(props)) {}

    /// The present optics. In variants that trace, the result keeps them if the instance is changed or deleted
    /// meanwhile. Scalar variants call no instances of other threads, and ask for every ray.
    auto optics() const {
        if constexpr (dr::is_jit_v<Float>)
            return std::atomic_load(&m_optics);
        else
            return m_optics.get();
    }

    void set_optics(Held optics) { std::atomic_store(&m_optics, std::make_shared<Held>(std::move(optics))); }

    std::shared_ptr<Held> m_optics;
};

template <typename Float, typename Spectrum> class Diffraction final : OpticsHolder<Float, Spectrum>,
                                                                       public BSDF<Float, Spectrum> {
    using Holder = OpticsHolder<Float, Spectrum>;
    using Holder::m_optics, Holder::optics, Holder::set_optics;

public:
    MI_IMPORT_BASE(BSDF, m_flags, m_components)
    MI_IMPORT_TYPES()

    explicit Diffraction(const Properties &props)
        : Holder(props), Base(props), m_coherence_length(m_optics->coherence_length_um()) {
        m_components = m_optics->components();
        for (uint32_t component : m_components)
            m_flags = m_flags | component;
    }

    void traverse(TraversalCallback *cb) override {
        m_optics->traverse(cb);
        cb->put("coherence_length", m_coherence_length, ParamFlags::NonDifferentiable);
    }

    void parameters_changed(const std::vector<std::string> &keys = {}) override {
        auto has_changed = [&](const char *key) { return std::find(keys.begin(), keys.end(), key) != keys.end(); };
        if (has_changed("eta") || has_changed("k"))
            set_optics(m_optics->without_index());
        if (const float built = m_optics->coherence_length_um(); m_coherence_length != built) {
            const float wanted = m_coherence_length;
            // A refused length throws and leaves the BSDF unchanged.
            m_coherence_length = built;
            set_optics(m_optics->with_coherence_length(wanted));
            m_coherence_length = wanted;
        }
        set_optics(m_optics->with_present_ends());
    }

    std::pair<BSDFSample3f, Spectrum> sample(const BSDFContext &ctx, const SurfaceInteraction3f &si, Float sample1,
                                             const Point2f &sample2, Mask active) const override {
        MI_MASKED_FUNCTION(ProfilerPhase::BSDFSample, active);
        return optics()->sample(ctx, si, sample1, sample2, active);
    }

    Spectrum eval(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo,
                  Mask active) const override {
        MI_MASKED_FUNCTION(ProfilerPhase::BSDFEvaluate, active);
        return optics()->template answer<true, false>(ctx, si, wo, active).first;
    }

    Float pdf(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo, Mask active) const override {
        MI_MASKED_FUNCTION(ProfilerPhase::BSDFEvaluate, active);
        return optics()->template answer<false, true>(ctx, si, wo, active).second;
    }

    std::pair<Spectrum, Float> eval_pdf(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo,
                                        Mask active) const override {
        MI_MASKED_FUNCTION(ProfilerPhase::BSDFEvaluate, active);
        return optics()->template answer<true, true>(ctx, si, wo, active);
    }

    std::tuple<Spectrum, Float, BSDFSample3f, Spectrum>
    eval_pdf_sample(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo, Float sample1,
                    const Point2f &sample2, Mask active) const override {
        MI_MASKED_FUNCTION(ProfilerPhase::BSDFSample, active);
        const auto optics       = this->optics();
        const auto [value, pdf] = optics->template answer<true, true>(ctx, si, wo, active);
        const auto [bs, weight] = optics->sample(ctx, si, sample1, sample2, active);
        return { value, pdf, bs, weight };
    }

    Spectrum eval_diffuse_reflectance(const SurfaceInteraction3f &si, Mask active) const override {
        return optics()->eval_diffuse_reflectance(si, active);
    }

    std::string to_string() const override { return optics()->to_string(); }

    MI_DECLARE_CLASS(Diffraction)

private:
    float m_coherence_length;

    MI_TRAVERSE_CB(Base, m_optics)
};

/// Registers one variant's constructor with Mitsuba. Returns 1, so that sums count the variants.
template <typename Float, typename Spectrum> size_t register_variant(std::string_view name, PluginRegisterFn fn) {
    using Class = Diffraction<Float, Spectrum>;
    fn(name, Class::Variant, Class::Type, [](void *, const Properties &props) -> ref<Object> {
        // Checked for each instance, not at load time, so that every attempt reports the reason.
        require_compatible(mitsuba_address);
        return new Class(props);
    });
    return 1;
}

} // namespace sunbeam
