// A flat clear layer over the relief, such as a lacquer. src/scattering/cover.rs is its twin in Rust, without
// polarisation and mirror reflection. The twin's `factor` includes 1/n², the change of radiance where light leaves the
// cover. Here `transmittance` and `through` leave 1/n² out, and reflection.h multiplies by it.
#pragma once

#include <utility>

#include <mitsuba/core/vector.h>
#include <mitsuba/render/fresnel.h>
#include <mitsuba/render/mueller.h>

namespace sunbeam {

namespace dr = drjit;

/// The flat side of a cover of index n ≥ 1, seen from air. With n = 1 there is no cover. Light that is reflected
/// repeatedly inside the cover is left out.
///
/// Directions are unit vectors in the shading frame that point away from the surface. They lie above it, inside or
/// outside the cover. `from` is the direction to the source of the light, `to` that in which it leaves. An argument
/// `cos_theta` is the cosine of the angle θ outside, and positive.
///
/// | symbol | meaning |
/// | --- | --- |
/// | n | index of the cover, `m_eta` |
/// | θ, θ' | angles of a direction with the normal outside and inside; sin θ' = sin θ / n (Snell's law) |
/// | `scaled` | n cos θ' = √(n² − sin² θ) = √(cos² θ + n² − 1), by `scaled_cosine` |
/// | s, p | linear polarisations perpendicular and parallel to the plane of incidence |
template <typename Float, typename Spectrum> class Cover {
public:
    using Mask                = dr::mask_t<Float>;
    using Vector3f            = mitsuba::Vector<Float, 3>;
    using UnpolarizedSpectrum = mitsuba::unpolarized_spectrum_t<Spectrum>;

    explicit Cover(float eta) : m_eta(eta) {}

    bool exists() const { return m_eta != 1.f; }
    float eta() const { return m_eta; }

    /// Direction inside of light that has the direction `w` outside.
    Vector3f inside(const Vector3f &w) const {
        if (!exists())
            return w;
        return Vector3f(w.x(), w.y(), scaled_cosine(w.z())) / m_eta;
    }

    /// Direction outside of light that has the direction `w` inside; the zero vector for light that is totally
    /// reflected, and for the zero vector.
    Vector3f outside(const Vector3f &w) const {
        if (!exists())
            return w;
        // The root has no derivative at zero. None is needed, since sampled directions are detached.
        const Float x = m_eta * w.x(), y = m_eta * w.y(), squared = 1.f - x * x - y * y;
        const Mask leaves = squared > 0.f && w.z() > 0.f;
        return dr::select(leaves, Vector3f(x, y, dr::sqrt(dr::maximum(squared, 0.f))), 0.f);
    }

    /// Solid angle inside per solid angle outside, cos θ / (n² cos θ'), about the direction `w` outside.
    Float solid_angle_ratio(const Vector3f &w) const {
        return exists() ? w.z() / (m_eta * m_eta * inside(w).z()) : Float(1.f);
    }

    /// Fresnel reflectance of the flat side for unpolarised light.
    Float reflectance(const Float &cos_theta) const {
        const auto [s, p] = reflectances(cos_theta);
        return .5f * (s + p);
    }

    /// Fresnel transmittance of light that enters from `wi` and leaves towards `wo`, both outside: the product of the
    /// means over s and p on each way, as for light that the relief depolarises.
    Float transmittance(const Vector3f &wi, const Vector3f &wo) const {
        if (!exists())
            return Float(1.f);
        const auto [s_i, p_i] = transmittances(wi.z());
        const auto [s_o, p_o] = transmittances(wo.z());
        return .25f * (s_i + p_i) * (s_o + p_o);
    }

    /// Mueller matrix outside the cover, transmittances included, for the directions `from` and `to` outside. `matrix`
    /// is the Mueller matrix inside the cover. Both matrices are between Mitsuba's frames of reference. Variants
    /// without polarisation have values for unpolarised light in place of both.
    Spectrum through(const Spectrum &matrix, const Vector3f &from, const Vector3f &to) const {
        if constexpr (mitsuba::is_polarized_v<Spectrum>) {
            namespace mueller = mitsuba::mueller;
            if (!exists())
                return matrix;
            // The s axis is tangential and perpendicular to the direction, so it is the same inside and outside.
            const Vector3f s_from = s_axis(from), s_to = s_axis(to);
            // Directions of travel: into the cover, inside it before the relief, and inside it after the relief.
            const Vector3f from_out = -from, from_in = -inside(from), to_in = inside(to);
            const Spectrum between = mueller::rotate_mueller_basis(matrix, from_in, mueller::stokes_basis(from_in),
                                                                   s_from, to_in, mueller::stokes_basis(to_in), s_to);
            const Spectrum passed  = transmission(to.z()) * between * transmission(from.z());
            return mueller::rotate_mueller_basis(passed, from_out, s_from, mueller::stokes_basis(from_out), to, s_to,
                                                 mueller::stokes_basis(to));
        } else {
            return matrix * transmittance(from, to);
        }
    }

    /// Mueller matrix, between Mitsuba's frames of reference, of the mirror reflection by the flat side. `to` is the
    /// mirror direction of `from`. Variants without polarisation have the reflectance.
    Spectrum mirror([[maybe_unused]] const Vector3f &from, const Vector3f &to) const {
        if constexpr (mitsuba::is_polarized_v<Spectrum>) {
            namespace mueller = mitsuba::mueller;
            using Complex     = dr::Complex<UnpolarizedSpectrum>;
            const Complex index(UnpolarizedSpectrum(m_eta), UnpolarizedSpectrum(0.f));
            const Spectrum matrix   = mueller::specular_reflection(UnpolarizedSpectrum(to.z()), index);
            const Vector3f from_out = -from, s = s_axis(from);
            return mueller::rotate_mueller_basis(matrix, from_out, s, mueller::stokes_basis(from_out), to, s,
                                                 mueller::stokes_basis(to));
        } else {
            return Spectrum(reflectance(to.z()));
        }
    }

private:
    /// Squared length of a direction's tangential part above which it has a plane of incidence. Shorter parts count as
    /// rounding, and the direction as the normal.
    static constexpr float TANGENT_SQUARED_MIN = 1e-20f;
    /// Smallest argument of the square root in `transmission`, because the root has no derivative at zero. A zero root
    /// becomes 1e-6.
    static constexpr float ROOT_MIN = 1e-12f;

    /// n cos θ' for the cosine of θ.
    Float scaled_cosine(const Float &cos_theta) const {
        return dr::sqrt(dr::fmadd(cos_theta, cos_theta, m_eta * m_eta - 1.f));
    }

    /// Fresnel reflectances of s and p polarised light.
    std::pair<Float, Float> reflectances(const Float &cos_theta) const {
        const Float scaled = scaled_cosine(cos_theta), outer = m_eta * m_eta * cos_theta;
        // Amplitudes; numerator and denominator of r_p are multiplied by n.
        const Float r_s = (cos_theta - scaled) / (cos_theta + scaled);
        const Float r_p = (outer - scaled) / (outer + scaled);
        return { r_s * r_s, r_p * r_p };
    }

    /// Fresnel transmittances of s and p polarised light, as products, since 1 − R would cancel near the horizon.
    std::pair<Float, Float> transmittances(const Float &cos_theta) const {
        const Float scaled = scaled_cosine(cos_theta);
        // Denominators of the Fresnel coefficients; that of p is multiplied by n.
        const Float sum_s = cos_theta + scaled, sum_p = dr::fmadd(m_eta * m_eta, cos_theta, scaled);
        const Float product = 4.f * cos_theta * scaled;
        return { product / (sum_s * sum_s), m_eta * m_eta * product / (sum_p * sum_p) };
    }

    /// Mueller matrix of the transmission, into or out of the cover, between frames whose first axis is s. The
    /// amplitudes of s and p are real and positive, so the transmission does not shift their phases. Instantiated only
    /// in polarised variants.
    Spectrum transmission(const Float &cos_theta) const {
        const auto [s, p] = transmittances(cos_theta);
        const Float mean = .5f * (s + p), difference = .5f * (s - p), product = dr::sqrt(dr::maximum(s * p, ROOT_MIN));
        Spectrum matrix = dr::zeros<Spectrum>();
        matrix(0, 0) = matrix(1, 1) = mean;
        matrix(0, 1) = matrix(1, 0) = difference;
        matrix(2, 2) = matrix(3, 3) = product;
        return matrix;
    }

    /// Unit vector perpendicular to the direction `w` and the normal; the y axis if `w` is along the normal.
    static Vector3f s_axis(const Vector3f &w) {
        const Float squared = dr::square(w.x()) + dr::square(w.y());
        const Float inverse = dr::rsqrt(dr::maximum(squared, TANGENT_SQUARED_MIN));
        return dr::select(squared > TANGENT_SQUARED_MIN, Vector3f(-w.y() * inverse, w.x() * inverse, 0.f),
                          Vector3f(0.f, 1.f, 0.f));
    }

    /// Index n of the cover.
    float m_eta;
};

} // namespace sunbeam
