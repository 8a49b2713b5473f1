// The BSDF class; the manual is at the top of diffraction.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <memory>

#include <mitsuba/core/spectrum.h>

#include "checks.h"
#include "optics.h"
#include "variants.h"

namespace sunbeam {

/// Optics of a BSDF instance, in a base class that is constructed before Mitsuba's BSDF and destroyed after it.
///
/// BSDF's constructor enters the instance in Dr.Jit's registry, and its destructor removes it. A thread that traces a
/// scene calls every BSDF in the registry, including those of other threads' scenes. Therefore the optics must exist at
/// least as long as the entry.
template <typename Float, typename Spectrum> class OpticsHolder {
protected:
    using ConstOptics = const Optics<Float, Spectrum>;

    explicit OpticsHolder(const Properties &props) : m_optics(std::make_shared<ConstOptics>(props)) {}

    /// Pointer to the current optics.
    ///
    /// Variants that trace get a shared pointer, because another thread may change or delete the instance during the
    /// call. Scalar variants get a plain pointer: a BSDF of another thread's scene is never called there, and counting
    /// references for every ray would be slow.
    auto optics() const {
        if constexpr (dr::is_jit_v<Float>)
            return std::atomic_load(&m_optics);
        else
            return m_optics.get();
    }

    /// Replaces the optics for later calls; calls that run keep those that they began with.
    void set_optics(Optics<Float, Spectrum> optics) {
        std::atomic_store(&m_optics, std::make_shared<ConstOptics>(std::move(optics)));
    }

    std::shared_ptr<ConstOptics> m_optics;
};

/// The plugin's BSDF: passes Mitsuba's calls on to the current optics.
template <typename Float, typename Spectrum> class Diffraction final : OpticsHolder<Float, Spectrum>,
                                                                       public BSDF<Float, Spectrum> {
    using Holder = OpticsHolder<Float, Spectrum>;
    using Holder::m_optics, Holder::optics, Holder::set_optics;

public:
    MI_IMPORT_BASE(BSDF, m_flags, m_components)
    MI_IMPORT_TYPES()

    explicit Diffraction(const Properties &props) : Holder(props), Base(props), m_numbers(m_optics->numbers()) {
        m_components = m_optics->components();
        for (uint32_t component : m_components)
            m_flags = m_flags | component;
    }

    void traverse(TraversalCallback *cb) override {
        m_optics->traverse(cb);
        auto put = [&](const char *name, float &number) { cb->put(name, number, +ParamFlags::NonDifferentiable); };
        put("coherence_length", m_numbers[0]);
        // Scale and depth are exposed as numbers unless they are textures, which the optics expose.
        if (!m_optics->has_scale_texture())
            put("scale", m_numbers[1]);
        if (!m_optics->has_depth_texture())
            put("depth", m_numbers[2]);
    }

    /// Replaces the optics after Mitsuba has written textures or numbers. `keys` are the names of those that changed;
    /// if there are none, `eta` and `k` count as unchanged. A change of these may rebuild the tables, and surfaces of
    /// the rigorous theory refuse it.
    void parameters_changed(const std::vector<std::string> &keys = {}) override {
        auto has_changed = [&](const char *key) { return std::find(keys.begin(), keys.end(), key) != keys.end(); };
        // Colour tables (RGB and mono variants) may include the interface's factor (interface.h) of the initial index.
        if (has_changed("eta") || has_changed("k"))
            set_optics(m_optics->without_index());
        // Numbers determine the tables, which are built anew where Mitsuba has written other numbers.
        if (const auto built = m_optics->numbers(); m_numbers != built) {
            const auto wanted = m_numbers;
            // `with_numbers` throws if it refuses a number. `m_numbers` then still holds those of the tables.
            m_numbers = built;
            set_optics(m_optics->with_numbers(wanted));
            m_numbers = wanted;
        }
        // The spectra of `eta` and `k` may cover other ranges of wavelengths now (spectral_ends.h).
        set_optics(m_optics->with_current_ends());
    }

    std::pair<BSDFSample3f, Spectrum> sample(const BSDFContext &ctx, const SurfaceInteraction3f &si, Float sample1,
                                             const Point2f &sample2, Mask active) const override {
        MI_MASKED_FUNCTION(ProfilerPhase::BSDFSample, active);
        return optics()->sample(ctx, si, sample1, sample2, active);
    }

    // The template arguments of `answer` tell whether it computes the value and whether the density.
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
        // Taken once, so that all results come from the same optics.
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
    /// Exposed parameters `coherence_length` in µm, `scale` and `depth` (factors on the relief's pattern and heights).
    /// Mitsuba writes them before it calls `parameters_changed`.
    std::array<float, 3> m_numbers;

    MI_TRAVERSE_CB(Base, m_optics)
};

/// Registers one variant's constructor with Mitsuba. Returns 1, the number of variants registered.
template <typename Float, typename Spectrum> size_t register_variant(std::string_view name, PluginRegisterFn fn) {
    using Class = Diffraction<Float, Spectrum>;
    fn(name, Class::Variant, Class::Type, [](void *, const Properties &props) -> ref<Object> {
        // Throws unless Mitsuba and the CPU suit the plugin. Checked for each instance instead of when the plugin is
        // loaded, so that every attempt reports the reason.
        require_compatible(mitsuba_address);
        return new Class(props);
    });
    return 1;
}

/// Registers the variants of one of Dr.Jit's backends and returns their number.
template <typename Float> size_t register_jit_variants(std::string_view name, PluginRegisterFn fn) {
    using Mono     = mitsuba::Color<Float, 1>;
    using RGB      = mitsuba::Color<Float, 3>;
    using Spectral = mitsuba::Spectrum<Float, 4>;
    return register_variant<Float, Mono>(name, fn) + register_variant<Float, mitsuba::MuellerMatrix<Mono>>(name, fn) +
           register_variant<Float, RGB>(name, fn) + register_variant<Float, Spectral>(name, fn) +
           register_variant<Float, mitsuba::MuellerMatrix<Spectral>>(name, fn);
}

} // namespace sunbeam
