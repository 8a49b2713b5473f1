// Optics of one BSDF instance: values, densities and samples, computed from its textures and its lobe's tables.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <mitsuba/core/properties.h>
#include <mitsuba/render/bsdf.h>

#include "compat.h"
#include "fingerprint.h"
#include "lobe.h"
#include "parameters.h"
#include "reflection.h"
#include "textures.h"
#include "transmission.h"

namespace sunbeam {

using namespace mitsuba;

/// Textures and tables of one instance.
///
/// Objects are never modified after construction: a change makes a copy. So one thread can trace an object while
/// another thread changes or deletes the instance. Only Mitsuba changes values, inside the textures.
///
/// The lobe (lobe.h) gives the value of the bare relief. `Reflection` has the optics of a surface that only reflects,
/// with an optional *cover*, a clear layer over the relief. `Transmission` has those of a *body* that transmits: a
/// *film*, or an *interface* to an endless medium. This class builds the lobe's tables and chooses between the two.
///
/// `Surface` is the Rust object that holds the tables (src/bridge.rs). `scale` and `depth` are the sizes of the
/// relief's pattern and heights, relative to the relief given. The *interface's factor* is the Fresnel reflectance or
/// the small-slope factor, from `eta` and `k`. Some tables include it (`is_interface_included`).
///
/// Variants `llvm_*` and `cuda_*` *trace*: Dr.Jit records the operations of one call into a kernel. A *frozen function*
/// (`dr.freeze`) replays recorded kernels with other inputs.
///
/// Directions `wi` and `wo` are unit vectors in the shading frame and point away from the surface.
template <typename Float, typename Spectrum> class Optics {
public:
    MI_IMPORT_TYPES(Texture)
    using Lobe = DiffractionLobe<Float, Spectrum>;

    explicit Optics(const Properties &props) {
        set_lobe(std::make_shared<const Lobe>(read_and_build(props)));
        m_components = m_transmission ? m_transmission->components(m_textures.diffraction_varies())
                                      : m_reflection.components(m_textures);
    }

    /// A copy with tables for other numbers: coherence length in µm, scale, and depth. Throws if one is out of range
    /// or the tables cannot be built.
    Optics with_numbers(const std::array<float, 3> &numbers) const {
        auto surface = checked([&] { return m_lobe->surface().with_numbers(numbers); });
        Optics optics(*this);
        optics.set_lobe(std::make_shared<const Lobe>(std::move(surface)));
        return optics;
    }

    /// A copy for changed `eta` and `k`: the interface's factor follows these textures in each call. Its tables
    /// include no factor. Throws for the rigorous theory, whose tables always include the material. Not called for a
    /// body that transmits: textures.h exposes no `eta` and `k` of a body.
    Optics without_index() const {
        std::shared_ptr<const Lobe> lobe = m_lobe;
        // These tables also serve the copy unless they include the factor.
        if (m_reflection.interface_included)
            lobe = std::make_shared<const Lobe>(checked([&] { return m_lobe->surface().without_index(); }));
        Optics optics(*this);
        optics.m_reflection.perfect            = false;
        optics.m_reflection.interface_included = false;
        // Last, since it also computes the fingerprint of the two choices above.
        optics.set_lobe(std::move(lobe));
        return optics;
    }

    /// A copy that reads the wavelength ranges of `eta` and `k` anew, after their spectra may have changed. Beyond its
    /// range a spectrum keeps the value at its end (spectral_ends.h).
    Optics with_current_ends() const {
        Optics optics(*this);
        auto &textures = optics.m_textures;
        textures.eta_ends.update(*textures.eta);
        textures.k_ends.update(*textures.k);
        optics.m_fingerprint = CodeFingerprint(optics.code());
        return optics;
    }

    /// `BSDFFlags` of each component, those of `Reflection` or of `Transmission`.
    const std::vector<uint32_t> &components() const { return m_components; }

    /// Coherence length in µm, scale and depth. A scale or depth that is a texture counts as 1.
    std::array<float, 3> numbers() const { return m_lobe->surface().numbers(); }

    /// Whether `scale` and `depth` are textures.
    bool has_scale_texture() const { return bool(m_textures.scale); }
    bool has_depth_texture() const { return bool(m_textures.depth); }

    /// Exposes the textures to Mitsuba as parameters that can change.
    void traverse(TraversalCallback *cb) const { m_textures.traverse(cb); }

    /// Reports the inputs of a frozen function to Dr.Jit: the variables of textures and tables, and the fingerprint of
    /// the traced code.
    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro fn) const {
        each_traversable([&](auto part) { dr::traverse_1_fn_ro(part, payload, fn); });
    }
    void traverse_1_cb_rw(void *payload, dr::detail::traverse_callback_rw fn) const {
        each_traversable([&](auto part) { dr::traverse_1_fn_rw(part, payload, fn); });
    }

    /// A direction, and its value times |cosθo| over its density. `sample1` chooses the component, then serves as the
    /// first of three variates in the diffracted lobe. The cover's mirror has a probability in place of a density.
    std::pair<BSDFSample3f, Spectrum> sample(const BSDFContext &ctx, const SurfaceInteraction3f &si, Float sample1,
                                             const Point2f &sample2, Mask active) const {
        if (m_transmission)
            return m_transmission->sample(*m_lobe, m_textures, ctx, si, sample1, sample2, active);
        return m_reflection.sample(*m_lobe, m_textures, ctx, si, sample1, sample2, active);
    }

    /// BSDF times |cosθo|, and density in 1/sr with which `sample` draws `wo`, over the enabled components. A part
    /// whose template argument is false has no meaning. Zero where a direction lies below a surface that only reflects.
    template <bool Value, bool Density> std::pair<Spectrum, Float>
    answer(const BSDFContext &ctx, const SurfaceInteraction3f &si, const Vector3f &wo, Mask active) const {
        if (m_transmission)
            return m_transmission->template answer<Value, Density>(*m_lobe, m_textures, ctx, si, wo, active);
        return m_reflection.template answer<Value, Density>(*m_lobe, m_textures, ctx, si, wo, active);
    }

    /// Reflectance of the pigment; zero without one. Mitsuba's integrators for albedos call this function.
    Spectrum eval_diffuse_reflectance(const SurfaceInteraction3f &si, Mask active) const {
        if (!m_textures.diffuse_reflectance)
            return 0.f;
        return depolarizer<Spectrum>(m_textures.diffuse_reflectance->eval(si, active));
    }

    std::string to_string() const {
        std::ostringstream oss;
        oss << "Diffraction[" << std::endl
            << "  surface = " << std_string(m_lobe->surface().describe()) << "," << std::endl;
        m_textures.print(oss);
        oss << "]";
        return oss.str();
    }

private:
    /// Empty stand-in for scalar variants, which trace no code.
    struct NoFingerprint {
        explicit NoFingerprint(uint64_t) {}
    };
    using CodeFingerprint = std::conditional_t<dr::is_jit_v<Float>, Fingerprint<Float>, NoFingerprint>;

    /// Sets the members for textures, reflection and transmission, then builds the tables of the lobe. All parameters
    /// are checked first, since building takes seconds. Throws if a parameter is refused.
    rust::Box<Surface> read_and_build(const Properties &props) {
        const std::string json = surface_json(props);
        m_reflection           = { float(cover_index(props).value_or(1.0)), props.get<bool>("cover_reflection", true) };
        check_optics(props);
        const std::string material = material_name(props);
        IndexSpectrum index        = index_spectrum(props, material);
        if (const std::optional<double> eta = transparent_index(props)) {
            // Constant eta, and k = 0.
            index = IndexSpectrum{ {}, { *eta }, {}, { 0.0 } };
            m_transmission =
                Transmission<Float, Spectrum>(float(*eta), props.get<std::string>("transmission") == "film",
                                              props.get<bool>("back_reflection", true));
        }
        m_reflection.perfect     = index.is_known && index.eta.empty();
        const TextureSizes sizes = m_textures.read(props, m_transmission.has_value(), material, index);
        refuse_unknown(props);
        const IndexSamples samples = index_samples(index);
        return checked([&] {
            constexpr bool polarised        = is_polarized_v<Spectrum>;
            rust::Box<Surface> surface      = is_spectral_v<Spectrum>
                                                  ? new_surface(rust_str(json), samples, sizes, polarised)
                                                  : new_colour_surface(rust_str(json), samples, sizes, polarised);
            m_reflection.interface_included = is_interface_included(*surface, samples.known);
            return surface;
        });
    }

    /// Whether `Reflection` need not apply the interface's factor to values from the tables of a new surface.
    /// `is_index_known` is false if `eta` or `k` is a texture or a colour.
    bool is_interface_included(const Surface &surface, bool is_index_known) const {
        if (surface.is_rigorous())
            return true;
        // Among the tables of scalar theory, those of RGB and mono variants include the factor of a known index.
        if (is_spectral_v<Spectrum> || !is_index_known)
            return false;
        // The tables of a perfect conductor have no factor. Its Fresnel reflectance is 1, but its small-slope factor
        // has to be computed.
        return !(m_reflection.perfect && surface.is_small_slope());
    }

    /// Converts the index for Rust. An unknown index has no values there, even if one of its parts is known.
    static IndexSamples index_samples(const IndexSpectrum &index) {
        auto copy = [](const std::vector<double> &from, rust::Vec<double> &to) {
            for (double value : from)
                to.push_back(value);
        };
        IndexSamples samples;
        samples.known = index.is_known;
        if (index.is_known) {
            copy(index.eta_nm, samples.eta_nm);
            copy(index.eta, samples.eta);
            copy(index.k_nm, samples.k_nm);
            copy(index.k, samples.k);
        }
        return samples;
    }

    /// Calls Rust and rethrows its errors as Mitsuba's.
    template <typename Call> static auto checked(const Call &call) -> decltype(call()) {
        try {
            return call();
        } catch (const std::exception &error) {
            Throw("%s", error.what());
        }
    }

    /// Sets the lobe, and the fingerprint of all members, of an object under construction.
    void set_lobe(std::shared_ptr<const Lobe> lobe) {
        m_lobe        = std::move(lobe);
        m_fingerprint = CodeFingerprint(code());
    }

    /// Number that identifies the traced code: that of the tables, followed by one bit for each choice that changes the
    /// code. `Fingerprint` keeps the lower 32 bits: the ten choices, and 22 bits of the tables' number.
    ///
    /// No bit tells a body from a surface that only reflects, or a film from an interface. The tables are built for
    /// these, and their number also tells covers apart.
    uint64_t code() const {
        const Surface &surface = m_lobe->surface();
        uint64_t code          = surface.identity();
        // Textures of eta and k that are clipped to the ranges of their spectra take two more operations.
        for (bool choice : { m_reflection.reflects_at_cover(), m_reflection.interface_included, m_reflection.perfect,
                             surface.is_small_slope(), bool(m_textures.diffuse_reflectance), has_scale_texture(),
                             has_depth_texture(), m_textures.eta_ends.are_clipped(), m_textures.k_ends.are_clipped(),
                             m_transmission && m_transmission->reflects_at_back() })
            code = 2 * code + choice;
        return code;
    }

    /// Calls `visit` with each member that holds variables of Dr.Jit.
    template <typename Visit> void each_traversable(const Visit &visit) const {
        m_textures.each_traversable(visit);
        visit(m_lobe);
        visit(m_fingerprint);
    }

    Textures<Float, Spectrum> m_textures;
    std::vector<uint32_t> m_components;
    /// Optics of a surface that only reflects; not called for a body that transmits. `read_and_build` replaces the
    /// initial value, which has no cover.
    Reflection<Float, Spectrum> m_reflection{ 1.f, false };
    /// Optics of a body that transmits; none for a surface that only reflects.
    std::optional<Transmission<Float, Spectrum>> m_transmission;
    std::shared_ptr<const Lobe> m_lobe;
    CodeFingerprint m_fingerprint{ 0 };
};

} // namespace sunbeam
