// The diffracted lobe, evaluated in Rust (cpp_shim/src/bridge.rs). Scalar variants of Mitsuba call Rust by value, ray
// by ray. Variants `llvm_*` and `cuda_*` trace: Dr.Jit records one call of Rust into a kernel that computes all rays.
#pragma once

#include <algorithm>
#include <utility>

#include <drjit/while_loop.h>
#include <mitsuba/core/spectrum.h>
#include <mitsuba/render/bsdf.h>

#include "buffers.h"

namespace sunbeam {

/// Value, density and samples of the diffracted light.
///
/// - Directions are unit vectors in the relief's frame (z is the normal, x the relief's x) and point away from the
///   surface.
/// - Wavelengths are in nm in spectral variants, and empty in RGB and mono variants.
/// - A `Size` holds the sizes of pattern and heights at a point, relative to the relief of the tables. Surfaces whose
///   `scale` and `depth` are both numbers ignore it.
/// - Values are the BSDF in 1/sr times |cosθo|.
/// - In spectral variants values leave out the interface's factor (Fresnel or small slope, interface.h). In RGB and
///   mono variants they include it if the surface was built with a known index. Values of rigorous surfaces (Maxwell's
///   equations) always include the material's reflectance.
/// - All results are zero where a direction lies below the surface. Bodies that transmit have both sides. Their values
///   are for light from wi to wo and include the interface's factor.
/// - In variants that trace, results are zero where `active` is false. Scalar variants ignore `active`, because their
///   callers mask the results.
template <typename Float, typename Spectrum> class DiffractionLobe {
public:
    using UnpolarizedSpectrum = mitsuba::unpolarized_spectrum_t<Spectrum>;
    using Wavelength          = mitsuba::wavelength_t<Spectrum>;
    using Vector3f            = mitsuba::Vector<Float, 3>;
    using Point2f             = mitsuba::Point<Float, 2>;
    using Mask                = dr::mask_t<Float>;
    /// Whether Dr.Jit records calls into a kernel.
    static constexpr bool Traces = dr::is_jit_v<Float>;
    /// Whether the variant's rays carry wavelengths.
    static constexpr bool IsSpectral = mitsuba::is_spectral_v<Spectrum>;

    /// Relative size of the pattern along the surface (`scale`) and of its heights (`depth`), in [1e-3, 1].
    struct Size {
        Float scale, depth;
    };

    explicit DiffractionLobe(rust::Box<Surface> surface) : m_surface(std::move(surface)), m_buffers(*m_surface) {}

    /// Value, differentiable by both directions and the size.
    UnpolarizedSpectrum eval(const Vector3f &wi, const Vector3f &wo, const Wavelength &wavelengths, const Size &size,
                             const Mask &active) const {
        return value(evaluate(Part::Value, wi, wo, wavelengths, size, active), wo) +
               zero_with_derivatives(wi, wo, wavelengths, size, active);
    }

    /// Density in 1/sr with which `sample` draws `wo`. Not differentiable, since it is no part of the integrand.
    Float pdf(const Vector3f &wi, const Vector3f &wo, const Wavelength &wavelengths, const Size &size,
              const Mask &active) const {
        return evaluate(Part::Density, wi, wo, wavelengths, size, active)[DENSITY];
    }

    /// Results of `eval` and `pdf`.
    std::pair<UnpolarizedSpectrum, Float> eval_pdf(const Vector3f &wi, const Vector3f &wo,
                                                   const Wavelength &wavelengths, const Size &size,
                                                   const Mask &active) const {
        const Answer answer = evaluate(Part::ValueAndDensity, wi, wo, wavelengths, size, active);
        return { value(answer, wo) + zero_with_derivatives(wi, wo, wavelengths, size, active), answer[DENSITY] };
    }

    /// Results of `eval` and `pdf`. A result whose template argument is false is zero.
    template <bool Value, bool Density>
    std::pair<UnpolarizedSpectrum, Float> answer(const Vector3f &wi, const Vector3f &wo, const Wavelength &wavelengths,
                                                 const Size &size, const Mask &active) const {
        if constexpr (Value && Density)
            return eval_pdf(wi, wo, wavelengths, size, active);
        else if constexpr (Value)
            return { eval(wi, wo, wavelengths, size, active), Float(0.f) };
        else
            return { UnpolarizedSpectrum(0.f), pdf(wi, wo, wavelengths, size, active) };
    }

    /// Mueller matrix in 1/sr of a rigorous surface in a polarised variant, without |cosθo|. Light comes from the
    /// direction `from` and leaves towards `to`. The first axis of each frame of reference is the grooves' direction
    /// (y) without its component along the light. Not differentiable.
    Spectrum matrix(const Vector3f &from, const Vector3f &to, const Wavelength &wavelengths, const Mask &active) const {
        const auto elements = evaluate_matrix(from, to, wavelengths, active);
        Spectrum matrix;
        for (size_t i = 0; i < 4; ++i)
            for (size_t j = 0; j < 4; ++j)
                matrix(i, j) = element(elements, 4 * i + j);
        return matrix;
    }

    /// Direction wo from three uniform variates in [0, 1); the zero vector where the draw falls below the horizon.
    Vector3f sample(const Vector3f &wi, const Wavelength &wavelengths, const Size &size, const Float &sample1,
                    const Point2f &sample2, const Mask &active) const {
        const Vector3f variates(sample1, sample2.x(), sample2.y());
        std::array<Float, 3> wo;
        if constexpr (Traces)
            wo = owned(m_surface->trace_sample(query(wi, wavelengths, size, active), indices(variates)));
        else
            wo = m_surface->sample(by_value(wi), by_value(variates), by_value(wavelengths), by_value(size));
        return { wo[0], wo[1], wo[2] };
    }

    const Surface &surface() const { return *m_surface; }

    /// Reports the tables to Dr.Jit as inputs of a frozen function (buffers.h).
    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro fn) const {
        dr::traverse_1_fn_ro(m_buffers, payload, fn);
    }
    void traverse_1_cb_rw(void *payload, dr::detail::traverse_callback_rw fn) const {
        dr::traverse_1_fn_rw(m_buffers, payload, fn);
    }

private:
    /// BSDF in 1/sr at four wavelengths, or as red, green, blue and luminance; then the density in 1/sr.
    using Answer = std::array<Float, 5>;
    /// Positions of the luminance and the density in an `Answer`.
    static constexpr size_t LUMINANCE = 3, DENSITY = 4;

    /// Value of an answer: the variant's channels times |cosθo|, not differentiable. `zero_with_derivatives` has the
    /// derivatives, including those of the cosine.
    static UnpolarizedSpectrum value(const Answer &answer, const Vector3f &wo) {
        const Float cos_theta_o = dr::abs(dr::detach(wo.z()));
        if constexpr (IsSpectral)
            return UnpolarizedSpectrum(answer[0], answer[1], answer[2], answer[3]) * cos_theta_o;
        else if constexpr (UnpolarizedSpectrum::Size == 1)
            return UnpolarizedSpectrum(answer[LUMINANCE]) * cos_theta_o;
        else
            return UnpolarizedSpectrum(answer[0], answer[1], answer[2]) * cos_theta_o;
    }

    /// Arguments of a call by value; the bridge ignores the wavelengths in RGB variants.
    static std::array<float, 3> by_value(const Vector3f &w) { return { w.x(), w.y(), w.z() }; }

    static std::array<float, 2> by_value(const Size &size) { return { size.scale, size.depth }; }

    static std::array<float, 4> by_value([[maybe_unused]] const Wavelength &wavelengths) {
        if constexpr (IsSpectral)
            return { wavelengths[0], wavelengths[1], wavelengths[2], wavelengths[3] };
        else
            return {};
    }

    /// Dr.Jit variables of a traced call, except those of its second vector (wo or variates). Borrows the arguments.
    TracedQuery query(const Vector3f &wi, [[maybe_unused]] const Wavelength &wavelengths, const Size &size,
                      const Mask &active) const {
        TracedQuery query{};
        query.backend = uint32_t(dr::backend_v<Float>);
        query.wi      = indices(wi);
        query.size    = { size.scale.index(), size.depth.index() };
        query.active  = active.index();
        query.words   = m_buffers.indices();
        if constexpr (IsSpectral)
            for (size_t i = 0; i < 4; ++i)
                query.wavelengths_nm[i] = wavelengths[i].index();
        return query;
    }

    static std::array<uint32_t, 3> indices(const Vector3f &w) {
        return { w.x().index(), w.y().index(), w.z().index() };
    }

    /// Answer of Rust, by value or traced. Parts that `part` leaves out are zero.
    Answer evaluate(Part part, const Vector3f &wi, const Vector3f &wo, const Wavelength &wavelengths, const Size &size,
                    [[maybe_unused]] const Mask &active) const {
        if constexpr (Traces)
            return owned(m_surface->trace_evaluate(part, query(wi, wavelengths, size, active), indices(wo)));
        else
            return m_surface->evaluate(part, by_value(wi), by_value(wo), by_value(wavelengths), by_value(size));
    }

    /// Matrix elements: number `4 (4 row + column) + wavelength`. In mono variants all four are the luminance's.
    auto evaluate_matrix(const Vector3f &from, const Vector3f &to, const Wavelength &wavelengths,
                         [[maybe_unused]] const Mask &active) const {
        // Rigorous surfaces ignore the size.
        if constexpr (Traces)
            return owned(m_surface->trace_matrix(query(from, wavelengths, { 1.f, 1.f }, active), indices(to)));
        else
            return m_surface->evaluate_matrix(by_value(from), by_value(to), by_value(wavelengths));
    }

    /// Takes ownership of variables that the bridge returned.
    template <size_t N> static std::array<Float, N> owned(const std::array<uint32_t, N> &indices) {
        std::array<Float, N> answer;
        std::transform(indices.begin(), indices.end(), answer.begin(), [](uint32_t i) { return Float::steal(i); });
        return answer;
    }

    /// Element `i = 4 row + column` of `evaluate_matrix`.
    template <size_t N> static UnpolarizedSpectrum element(const std::array<Float, N> &elements, size_t i) {
        if constexpr (IsSpectral)
            return UnpolarizedSpectrum(elements[4 * i], elements[4 * i + 1], elements[4 * i + 2], elements[4 * i + 3]);
        else
            return UnpolarizedSpectrum(elements[4 * i]);
    }

    /// Zero, with the derivatives of the value by the components of wi and wo and by the size, from central
    /// differences. Added to the value, it makes the value differentiable.
    ///
    /// Dr.Jit's reverse mode cannot differentiate the look-ups themselves: their loops have a number of steps that
    /// depends on the directions.
    UnpolarizedSpectrum zero_with_derivatives(const Vector3f &wi, const Vector3f &wo, const Wavelength &wavelengths,
                                              const Size &size, const Mask &active) const {
        if constexpr (dr::is_diff_v<Float>) {
            if (m_surface->has_sizes())
                return zero_with_derivatives_by<8>(
                    { wi.x(), wi.y(), wi.z(), wo.x(), wo.y(), wo.z(), size.scale, size.depth }, wavelengths, size,
                    active);
            return zero_with_derivatives_by<6>({ wi.x(), wi.y(), wi.z(), wo.x(), wo.y(), wo.z() }, wavelengths, size,
                                               active);
        }
        return UnpolarizedSpectrum(0.f);
    }

    /// Range of sizes. Rust clips others to it (`RELATIVE_SIZE`, src/scattering/size.rs).
    static constexpr float SMALLEST_SIZE = 1e-3f, LARGEST_SIZE = 1.f;

    /// Largest step of each component in a difference quotient: x, y and z of wi, those of wo, scale and depth.
    ///
    /// The look-ups' frequencies are proportional to scale·(wi + wo) and their phase rate κ to
    /// depth·(cosθi + cosθo). Both sums are at most 2. So a size takes half the step of a direction, which moves a
    /// look-up equally far at most.
    std::array<float, 8> largest_steps() const {
        const Steps steps = m_surface->steps();
        const float x = steps.tangential[0], y = steps.tangential[1], z = steps.normal;
        const float scale_step = .5f * std::min(x, y), depth_step = .5f * z;
        return { x, y, z, x, y, z, scale_step, depth_step };
    }

    /// Values of component `c`, numbered as in `largest_steps`, one step forwards and one step backwards from `centre`.
    static std::pair<Float, Float> stepped(uint32_t c, const Float &centre, float largest) {
        const bool is_size = c >= 6, is_tangential = !is_size && c % 3 < 2;
        // A cosine or a size moves by at most a quarter of its value, so that it does not cross zero.
        const Float step = is_tangential ? Float(largest) : dr::minimum(largest, .25f * dr::abs(centre));
        Float forwards = centre + step, backwards = centre - step;
        // At an end of the range of sizes the quotient is one-sided.
        if (is_size) {
            forwards  = dr::clip(forwards, SMALLEST_SIZE, LARGEST_SIZE);
            backwards = dr::clip(backwards, SMALLEST_SIZE, LARGEST_SIZE);
        }
        return { forwards, backwards };
    }

    /// Zero with derivatives by the components x, y and z of wi, those of wo, and scale and depth if N is 8.
    template <size_t N> UnpolarizedSpectrum zero_with_derivatives_by(const std::array<Float, N> &components,
                                                                     const Wavelength &wavelengths, const Size &size,
                                                                     const Mask &active) const {
        UnpolarizedSpectrum change(0.f);
        if (std::none_of(components.begin(), components.end(), [](const Float &c) { return dr::grad_enabled(c); }))
            return change;
        using UInt32 = dr::uint32_array_t<Float>;
        using Slopes = dr::Array<UnpolarizedSpectrum, N>;
        std::array<Float, N> centre;
        std::transform(components.begin(), components.end(), centre.begin(),
                       [](const Float &c) { return dr::detach(c); });
        const std::array<float, 8> largest = largest_steps();
        UInt32 i(0);
        Slopes slopes(UnpolarizedSpectrum(0.f));
        // A loop of 2 N evaluations keeps the kernel small. Iteration i moves component i / 2, forwards if i is even
        // and backwards if it is odd.
        dr::tie(i, slopes) = dr::while_loop(
            dr::make_tuple(i, slopes), [&](const UInt32 &i, const Slopes &) { return active && i < uint32_t(2 * N); },
            [&](UInt32 &i, Slopes &slopes) {
                const Float sign           = dr::select((i & 1u) == 0u, Float(1.f), Float(-1.f));
                std::array<Float, N> moved = centre;
                Float distance(0.f);
                for (uint32_t c = 0; c < N; ++c) {
                    const auto [forwards, backwards] = stepped(c, centre[c], largest[c]);
                    const auto is_moved              = (i >> 1) == c;
                    moved[c] = dr::select(is_moved, dr::select(sign > 0.f, forwards, backwards), moved[c]);
                    // Distance of the two positions after clipping and rounding to single precision; about 2 · step.
                    distance = dr::select(is_moved, forwards - backwards, distance);
                }
                const Vector3f wi(moved[0], moved[1], moved[2]), wo(moved[3], moved[4], moved[5]);
                Size moved_size{ dr::detach(size.scale), dr::detach(size.depth) };
                if constexpr (N == 8)
                    moved_size = { moved[6], moved[7] };
                const auto moved_value = value(evaluate(Part::Value, wi, wo, wavelengths, moved_size, active), wo);
                for (uint32_t c = 0; c < N; ++c)
                    // Sizes beyond the range have no distance, and no slope.
                    slopes[c] += dr::select((i >> 1) == c && distance > 0.f, moved_value * (sign / distance), 0.f);
                i += 1;
            },
            "slopes");
        // `components - centre` is zero in value. Its derivative is that of the components.
        for (uint32_t c = 0; c < N; ++c)
            change += slopes[c] * (components[c] - centre[c]);
        return change;
    }

    /// Empty stand-in for scalar variants, which read the tables in Rust.
    struct NoBuffers {
        explicit NoBuffers(const Surface &) {}
    };

    rust::Box<Surface> m_surface;
    std::conditional_t<Traces, Buffers<Float>, NoBuffers> m_buffers;
};

} // namespace sunbeam
