// The interface's factor between two directions: R (Fresnel) or Q (small slope) of docs/model.md as a number, or as a
// Mueller matrix in polarised variants.
#pragma once

#include <mitsuba/core/spectrum.h>
#include <mitsuba/core/vector.h>
#include <mitsuba/render/fresnel.h>
#include <mitsuba/render/mueller.h>

namespace sunbeam {

/// Reflection by an interface of complex index.
///
/// Directions are unit vectors in the shading frame and point away from the surface: `from` towards the light, `to`
/// towards the viewer. Both lie above the surface. Small-slope symbols follow src/scattering/small_slope.rs: `q0` and
/// `q` are the cosines of `from` and `to`, `w` their sum, `cos` and `sin` those of the azimuth between them, `sines`
/// the product of the polar sines, and ε the squared index.
template <typename Float, typename Spectrum> class Interface {
public:
    using UnpolarizedSpectrum = mitsuba::unpolarized_spectrum_t<Spectrum>;
    using Complex             = dr::Complex<UnpolarizedSpectrum>;
    using Vector2f            = mitsuba::Vector<Float, 2>;
    using Vector3f            = mitsuba::Vector<Float, 3>;
    using Mask                = dr::mask_t<Float>;

    /// `small_slope` selects Q instead of R. `perfect` selects the perfect conductor, for which Q has a form of its
    /// own.
    Interface(const Complex &index, bool small_slope, bool perfect)
        : m_index(index), m_epsilon(dr::square(index)), m_small_slope(small_slope), m_perfect(perfect) {}

    /// The factor for unpolarised light.
    UnpolarizedSpectrum power(const Vector3f &from, const Vector3f &to) const {
        if (m_small_slope)
            return small_slope_power(from, to);
        return mitsuba::fresnel_conductor(UnpolarizedSpectrum(cos_half(from, to)), m_index);
    }

    /// The Mueller matrix between Mitsuba's frames of reference for light that arrives along `-from` and leaves along
    /// `to`.
    Spectrum mueller(const Vector3f &from, const Vector3f &to) const {
        namespace mueller = mitsuba::mueller;
        Spectrum matrix;
        Vector3f s_in, s_out;
        if (m_small_slope) {
            const Azimuth azimuth(from, to);
            matrix = small_slope_matrix(from, to, azimuth);
            s_in   = Vector3f(-azimuth.from.y(), azimuth.from.x(), 0.f);
            s_out  = Vector3f(-azimuth.to.y(), azimuth.to.x(), 0.f);
        } else {
            matrix = mueller::specular_reflection(UnpolarizedSpectrum(cos_half(from, to)), m_index);
            // The s axis is perpendicular to both directions. Where they coincide, s and p reflect alike and any axis
            // serves.
            const Vector3f normal = dr::cross(from, to);
            const Float squared   = dr::squared_norm(normal);
            s_in                  = dr::select(squared > 1e-10f, normal * dr::rsqrt(dr::maximum(squared, 1e-10f)),
                                               mitsuba::coordinate_system(to).first);
            s_out                 = s_in;
        }
        return in_stokes_bases(matrix, from, s_in, to, s_out);
    }

    /// Converts a Mueller matrix from frames of reference with the given first axes to Mitsuba's.
    static Spectrum in_stokes_bases(const Spectrum &matrix, const Vector3f &from, const Vector3f &first_in,
                                    const Vector3f &to, const Vector3f &first_out) {
        namespace mueller = mitsuba::mueller;
        return mueller::rotate_mueller_basis(matrix, Vector3f(-from), first_in, mueller::stokes_basis(Vector3f(-from)),
                                             to, first_out, mueller::stokes_basis(to));
    }

private:
    /// Unit tangential vectors along which the light arrives and leaves. A direction along the normal takes the
    /// other's.
    struct Azimuth {
        Vector2f from, to;

        Azimuth(const Vector3f &wi, const Vector3f &wo) {
            const Vector2f k0(-wi.x(), -wi.y()), k(wo.x(), wo.y());
            const Float k0_squared = dr::squared_norm(k0), k_squared = dr::squared_norm(k);
            const Mask has_k0 = k0_squared > 1e-24f, has_k = k_squared > 1e-24f;
            const Vector2f k0_unit = k0 * dr::rsqrt(dr::maximum(k0_squared, 1e-24f)),
                           k_unit  = k * dr::rsqrt(dr::maximum(k_squared, 1e-24f));
            to                     = dr::select(has_k, k_unit, dr::select(has_k0, k0_unit, Vector2f(1.f, 0.f)));
            from                   = dr::select(has_k0, k0_unit, to);
        }
        Float cos() const { return dr::dot(from, to); }
        Float sin() const { return from.x() * to.y() - from.y() * to.x(); }
    };

    /// Terms of one direction with cosine q: the transmitted normal component t = √(ε − 1 + q²), and the denominators
    /// q + t of s and εq + t of p.
    struct Side {
        Complex t, s, p;

        Side(const Float &q, const Complex &epsilon) {
            t = dr::sqrt(epsilon - UnpolarizedSpectrum(dr::fnmadd(q, q, 1.f)));
            s = UnpolarizedSpectrum(q) + t;
            p = epsilon * UnpolarizedSpectrum(q) + t;
        }
    };

    /// Cosine between either direction and the half vector. Computed from their sum, which is symmetric: a dot product
    /// with one of them rounds differently for each, by as much as this cosine near the horizon.
    static Float cos_half(const Vector3f &from, const Vector3f &to) {
        return dr::minimum(.5f * dr::norm(from + to), 1.f);
    }

    /// Cosine with the normal, at least COSINE_MIN of src/scattering/geometry.rs.
    static Float cosine(const Vector3f &w) { return dr::maximum(w.z(), 1e-7f); }

    /// Q for unpolarised light; twin of `small_slope` in src/scattering/small_slope.rs.
    UnpolarizedSpectrum small_slope_power(const Vector3f &from, const Vector3f &to) const {
        const Float q0 = cosine(from), q = cosine(to), product = q * q0, w = q + q0;
        const Float q_squared = q * q, q0_squared = q0 * q0;
        const Float half = .5f * dr::squared_norm(Vector3f(from.x() + to.x(), from.y() + to.y(), w));
        // Positive, since a square root has no derivative at zero.
        const Float sines = dr::sqrt(dr::maximum((1.f - q_squared) * (1.f - q0_squared), 1e-12f)),
                    cos = dr::clip((1.f + product - half) / sines, -1.f, 1.f), cos_squared = cos * cos,
                    sin_squared = 1.f - cos_squared;
        if (m_perfect) {
            // cos − sines. At grazing directions the difference cancels; the second form does not.
            const Float grazing    = (q_squared + q0_squared + product - q_squared * q0_squared - half) / sines;
            const Float difference = dr::select(sines < .5f, cos - sines, grazing);
            const Float straight   = dr::fmadd(difference, difference, cos_squared * product * product);
            return UnpolarizedSpectrum(2.f * (straight + sin_squared * (q_squared + q0_squared)) / (product * w * w));
        }
        const Side o(q, m_epsilon), i(q0, m_epsilon);
        auto per = [](const Complex &z) { return dr::rcp(dr::maximum(dr::squared_norm(z), 1e-18f)); };
        const UnpolarizedSpectrum s = per(o.s), s0 = per(i.s), p = per(o.p), p0 = per(i.p);
        const Complex pp = o.t * i.t * UnpolarizedSpectrum(cos) - m_epsilon * UnpolarizedSpectrum(sines);
        const UnpolarizedSpectrum straight = cos_squared * s * s0 + dr::squared_norm(pp) * p * p0,
                                  crossed =
                                      sin_squared * (dr::squared_norm(o.t) * p * s0 + dr::squared_norm(i.t) * p0 * s);
        return dr::squared_norm(m_epsilon - 1.f) * (straight + crossed) * (2.f * product / (w * w));
    }

    /// Mueller matrix of the amplitudes, between frames of reference along s; twin of `small_slope_amplitudes` in
    /// src/scattering/small_slope.rs. Instantiated in polarised variants alone.
    Spectrum small_slope_matrix(const Vector3f &from, const Vector3f &to, const Azimuth &azimuth) const {
        const Float q0 = cosine(from), q = cosine(to), product = q * q0, w = q + q0;
        const UnpolarizedSpectrum g(4.f * product / (w * w));
        const UnpolarizedSpectrum cos(azimuth.cos()), sin(azimuth.sin());
        // Positive, as in small_slope_power.
        const Float squares = (dr::square(from.x()) + dr::square(from.y())) * (dr::square(to.x()) + dr::square(to.y()));
        const UnpolarizedSpectrum sines(dr::sqrt(dr::maximum(squares, 1e-24f)));
        if (m_perfect) {
            // cos − sines without cancellation, as in small_slope_power.
            const Float half = .5f * dr::squared_norm(Vector3f(from.x() + to.x(), from.y() + to.y(), w));
            const Float difference =
                (q * q + q0 * q0 + product - product * product - half) / dr::maximum(Float(sines[0]), 1e-6f);
            const UnpolarizedSpectrum pp =
                dr::select(sines > .5f, UnpolarizedSpectrum(difference), cos - sines) / product;
            return g * jones_to_mueller(Complex(-cos), Complex(sin / q0), Complex(sin / q), Complex(pp));
        }
        const Side o(q, m_epsilon), i(q0, m_epsilon);
        const Complex contrast = m_epsilon - 1.f;
        return g * jones_to_mueller(-contrast * cos / (o.s * i.s), contrast * i.t * sin / (o.s * i.p),
                                    contrast * o.t * sin / (o.p * i.s),
                                    contrast * (o.t * i.t * cos - m_epsilon * sines) / (o.p * i.p));
    }

    /// Mueller matrix of a Jones matrix; the first letter is the outgoing state, and states are right-handed with the
    /// light's direction. With the time dependence exp(−iωt), Mitsuba's fourth Stokes component is 2 Im(x y*).
    static Spectrum jones_to_mueller(const Complex &xx, const Complex &xy, const Complex &yx, const Complex &yy) {
        auto power                  = [](const Complex &z) { return dr::squared_norm(z); };
        const UnpolarizedSpectrum a = power(xx), b = power(xy), c = power(yx), d = power(yy);
        const Complex x = xx * dr::conj(xy), y = yx * dr::conj(yy); // of one state out
        const Complex u = xx * dr::conj(yx), v = xy * dr::conj(yy); // of one state in
        const Complex f = xx * dr::conj(yy), g = xy * dr::conj(yx);
        auto re = [](const Complex &z) { return dr::real(z); };
        auto im = [](const Complex &z) { return dr::imag(z); };
        return Spectrum(.5f * (a + b + c + d), .5f * (a - b + c - d), re(x + y), -im(x + y), //
                        .5f * (a + b - c - d), .5f * (a - b - c + d), re(x - y), -im(x - y), //
                        re(u + v), re(u - v), re(f + g), -im(f - g),                         //
                        im(u + v), im(u - v), im(f + g), re(f - g));
    }

    Complex m_index, m_epsilon;
    bool m_small_slope, m_perfect;
};

} // namespace sunbeam
