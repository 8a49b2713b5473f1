// Reflection factor of the interface, the boundary between the material and the air or cover above it: R (Fresnel) or Q
// (small slope) of docs/model.md, for a pair of directions. It is a number for unpolarised light and a Mueller matrix
// in polarised variants.
#pragma once

#include <mitsuba/core/spectrum.h>
#include <mitsuba/core/vector.h>
#include <mitsuba/render/fresnel.h>
#include <mitsuba/render/mueller.h>

namespace sunbeam {

namespace dr = drjit;

/// Reflection by the interface to a medium whose complex refractive index is relative to the air or cover above it.
///
/// Directions are unit vectors in the shading frame and point away from the surface: `from` towards the light, `to`
/// towards the viewer. Both lie above the surface.
///
/// Small-slope symbols and formulas follow the Rust core, src/scattering/small_slope.rs; tests/test_twins.py compares
/// both for unpolarised light. The amplitudes are 2 √(q q0) / w · B. The states of linear polarisation are s,
/// perpendicular to the plane of the light's direction and the normal, and p, in this plane. The first letter of a
/// subscript is the outgoing state, the second the incident state. A suffix 0 marks quantities of `from`:
///
///     B_ss = −(ε − 1) cos/(D_s D_s0)     B_sp = (ε − 1) t0 sin/(D_s D_p0)
///     B_ps = (ε − 1) t sin/(D_p D_s0)    B_pp = (ε − 1) (t t0 cos − ε sines)/(D_p D_p0)
///     Q = 2 q q0 / w² · (|B_ss|² + |B_sp|² + |B_ps|² + |B_pp|²)
///
/// A perfect conductor, the limit of large ε, has
///
///     B_ss = −cos    B_sp = sin/q0    B_ps = sin/q    B_pp = (cos − sines)/(q q0)
///
/// | symbol | meaning |
/// | --- | --- |
/// | `q0`, `q` | cosines of `from` and `to` with the normal |
/// | `w` | q + q0 |
/// | `product` | q q0 |
/// | `sines` | product of the sines of the two polar angles, k k0 in small_slope.rs |
/// | `cos`, `sin` | cosine and sine of the azimuth from the incident to the outgoing light |
/// | `epsilon` | ε, the squared index |
/// | `t` | √(ε − 1 + q²), the normal component of the transmitted wave vector over the wave number above the surface |
/// | `d_s`, `d_p` | D_s = q + t and D_p = εq + t, the denominators of Fresnel's coefficients |
/// | `half` | half the squared length of `from + to`, which is 1 + from·to |
/// | `grazing` | cos − sines without cancellation: (q² + q0² + q q0 − q² q0² − half) / sines |
template <typename Float, typename Spectrum> class Interface {
public:
    using UnpolarizedSpectrum = mitsuba::unpolarized_spectrum_t<Spectrum>;
    using Complex             = dr::Complex<UnpolarizedSpectrum>;
    using Vector2f            = mitsuba::Vector<Float, 2>;
    using Vector3f            = mitsuba::Vector<Float, 3>;
    using Mask                = dr::mask_t<Float>;

    /// `index` is eta + ik. `small_slope` selects Q instead of R. `perfect` selects a perfect conductor, whose factor
    /// and Mueller matrix do not depend on the index.
    Interface(const Complex &index, bool small_slope, bool perfect)
        : m_index(index), m_epsilon(dr::square(index)), m_small_slope(small_slope), m_perfect(perfect) {}

    /// The factor for unpolarised light.
    UnpolarizedSpectrum power(const Vector3f &from, const Vector3f &to) const {
        if (m_small_slope)
            return small_slope_power(from, to);
        return reflectance(cos_half(from, to), m_index, m_perfect);
    }

    /// Fresnel reflectance R for unpolarised light at an angle of incidence with the cosine `cos_theta`.
    ///
    /// A perfect conductor has R = 1. Mitsuba's `fresnel_conductor` would subtract two equal numbers for its index 0 +
    /// i and take the root. CUDA's roots, off by up to one unit in the last place, would lower R by up to 5e-4.
    static UnpolarizedSpectrum reflectance(const Float &cos_theta, const Complex &index, bool perfect) {
        return perfect ? UnpolarizedSpectrum(1.f) : mitsuba::fresnel_conductor(UnpolarizedSpectrum(cos_theta), index);
    }

    /// Mueller matrix of light that arrives along `-from` and leaves along `to`, between the frames of reference that
    /// Mitsuba assigns to these directions (`stokes_basis`). All functions of matrices are instantiated only in
    /// polarised variants, where `Spectrum` is a Mueller matrix.
    Spectrum mueller(const Vector3f &from, const Vector3f &to) const {
        Spectrum matrix;
        Vector3f s_in, s_out;
        if (m_small_slope) {
            const Azimuth azimuth(from, to);
            matrix = small_slope_matrix(from, to, azimuth);
            s_in   = Vector3f(-azimuth.in.y(), azimuth.in.x(), 0.f);
            s_out  = Vector3f(-azimuth.out.y(), azimuth.out.x(), 0.f);
        } else {
            // A perfect conductor has r_s = −1 and r_p = 1 at every angle. The index 0 + i has the same reflectance,
            // but phases that depend on the angle.
            if (m_perfect)
                matrix = jones_to_mueller(Complex(-1.f), Complex(0.f), Complex(0.f), Complex(1.f));
            else
                matrix = mitsuba::mueller::specular_reflection(UnpolarizedSpectrum(cos_half(from, to)), m_index);
            // The s axis is perpendicular to both directions. If the two coincide, s and p have the same reflectance,
            // and any axis perpendicular to them serves.
            const Vector3f normal = dr::cross(from, to);
            const Float squared   = dr::squared_norm(normal);
            s_in =
                dr::select(squared > NORMAL_SQUARED_MIN, normal * dr::rsqrt(dr::maximum(squared, NORMAL_SQUARED_MIN)),
                           mitsuba::coordinate_system(to).first);
            s_out = s_in;
        }
        return in_stokes_bases(matrix, from, s_in, to, s_out);
    }

    /// Converts a Mueller matrix to Mitsuba's frames of reference. `first_in` and `first_out` are the first axes of its
    /// own frames for the incident and the outgoing light: unit vectors perpendicular to `from` and `to`.
    static Spectrum in_stokes_bases(const Spectrum &matrix, const Vector3f &from, const Vector3f &first_in,
                                    const Vector3f &to, const Vector3f &first_out) {
        namespace mueller = mitsuba::mueller;
        return mueller::rotate_mueller_basis(matrix, Vector3f(-from), first_in, mueller::stokes_basis(Vector3f(-from)),
                                             to, first_out, mueller::stokes_basis(to));
    }

    /// Mueller matrix of a Jones matrix with the elements [[xx, xy], [yx, yy]]: the first letter is the outgoing state,
    /// the second the incident state. Both frames (x, y, direction of travel) are right-handed.
    ///
    /// With the time dependence exp(−iωt), Mitsuba's Stokes vector is |x|² + |y|², |x|² − |y|², 2 Re(x y*), 2 Im(x y*).
    static Spectrum jones_to_mueller(const Complex &xx, const Complex &xy, const Complex &yx, const Complex &yy) {
        auto power                  = [](const Complex &z) { return dr::squared_norm(z); };
        const UnpolarizedSpectrum a = power(xx), b = power(xy), c = power(yx), d = power(yy);
        // Products of two elements with the same outgoing state x or y.
        const Complex out_x = xx * dr::conj(xy), out_y = yx * dr::conj(yy);
        // Products of two elements with the same incident state x or y.
        const Complex in_x = xx * dr::conj(yx), in_y = xy * dr::conj(yy);
        // Products of two elements that share no state.
        const Complex diagonal = xx * dr::conj(yy), antidiagonal = xy * dr::conj(yx);
        auto re = [](const Complex &z) { return dr::real(z); };
        auto im = [](const Complex &z) { return dr::imag(z); };
        // The empty comments keep one row of the matrix in each line when the file is formatted.
        return Spectrum(.5f * (a + b + c + d), .5f * (a - b + c - d), re(out_x + out_y), -im(out_x + out_y),         //
                        .5f * (a + b - c - d), .5f * (a - b - c + d), re(out_x - out_y), -im(out_x - out_y),         //
                        re(in_x + in_y), re(in_x - in_y), re(diagonal + antidiagonal), -im(diagonal - antidiagonal), //
                        im(in_x + in_y), im(in_x - in_y), im(diagonal + antidiagonal), re(diagonal - antidiagonal));
    }

private:
    /// Squared sine of the angle between the directions above which their cross product gives the s axis. At smaller
    /// angles rounding in single precision would turn the axis by more than about 0.01 rad. With a larger bound more
    /// pairs of directions would get an arbitrary axis.
    static constexpr float NORMAL_SQUARED_MIN = 1e-10f;
    /// Squared length of a tangential vector above which it has an azimuth. This bound and its reciprocal root are
    /// normal (not subnormal) numbers in single precision. A larger bound would leave more directions without an
    /// azimuth.
    static constexpr float TANGENT_SQUARED_MIN = 1e-24f;
    /// Smallest argument of the square root of `sines`, which has no derivative at zero.
    static constexpr float ROOT_MIN = 1e-24f;
    /// Smallest product of sines as a divisor, equal to SINES_MIN of src/scattering/small_slope.rs.
    static constexpr float SINES_MIN = 1e-6f;
    /// Square of SINES_MIN, for a product of sines that is still squared.
    static constexpr float SINES_SQUARED_MIN = 1e-12f;
    /// Product of sines above which `grazing` replaces `cos - sines`, whose terms may then cancel. Below it the
    /// numerator of `grazing` cancels.
    static constexpr float SINES_GRAZING = .5f;
    /// Smallest squared modulus of `d_s` and `d_p` as a divisor, equal to SQUARED_MODULUS_MIN of
    /// src/scattering/small_slope.rs: products of two reciprocals then stay finite in single precision.
    static constexpr float DIVISOR_SQUARED_MIN = 1e-18f;

    /// Tangential unit vectors along which the light arrives and leaves. A direction along the normal has no tangential
    /// part and takes the unit vector of the other direction. If both are along the normal, both take +x.
    struct Azimuth {
        Vector2f in, out;

        Azimuth(const Vector3f &from, const Vector3f &to) {
            const Vector2f k0(-from.x(), -from.y()), k(to.x(), to.y());
            const Float k0_squared = dr::squared_norm(k0), k_squared = dr::squared_norm(k);
            const Mask has_k0 = k0_squared > TANGENT_SQUARED_MIN, has_k = k_squared > TANGENT_SQUARED_MIN;
            const Vector2f k0_unit = k0 * dr::rsqrt(dr::maximum(k0_squared, TANGENT_SQUARED_MIN)),
                           k_unit  = k * dr::rsqrt(dr::maximum(k_squared, TANGENT_SQUARED_MIN));
            out                    = dr::select(has_k, k_unit, dr::select(has_k0, k0_unit, Vector2f(1.f, 0.f)));
            in                     = dr::select(has_k0, k0_unit, out);
        }
        Float cos() const { return dr::dot(in, out); }
        Float sin() const { return in.x() * out.y() - in.y() * out.x(); }
    };

    /// Terms of one direction with cosine q.
    struct Terms {
        Complex t, d_s, d_p;

        Terms(const Float &q, const Complex &epsilon) {
            t   = dr::sqrt(epsilon - UnpolarizedSpectrum(dr::fnmadd(q, q, 1.f)));
            d_s = UnpolarizedSpectrum(q) + t;
            d_p = epsilon * UnpolarizedSpectrum(q) + t;
        }
    };

    /// Cosine between either direction and the half vector, computed from the length of their sum. A dot product with
    /// one direction would round differently for each of the two, near the horizon by as much as the cosine itself.
    static Float cos_half(const Vector3f &from, const Vector3f &to) {
        return dr::minimum(.5f * dr::norm(from + to), 1.f);
    }

    /// Cosine with the normal; the lower bound is COSINE_MIN of src/scattering/geometry.rs.
    static Float cosine(const Vector3f &direction) { return dr::maximum(direction.z(), 1e-7f); }

    /// `half`, from the directions and the sum `w` of their bounded cosines.
    static Float half_squared_length(const Vector3f &from, const Vector3f &to, const Float &w) {
        return .5f * dr::squared_norm(Vector3f(from.x() + to.x(), from.y() + to.y(), w));
    }

    /// Q for unpolarised light, equal to `small_slope` in src/scattering/small_slope.rs.
    UnpolarizedSpectrum small_slope_power(const Vector3f &from, const Vector3f &to) const {
        const Float q0 = cosine(from), q = cosine(to), product = q * q0, w = q + q0;
        const Float q_squared = q * q, q0_squared = q0 * q0;
        const Float half = half_squared_length(from, to, w);
        // Positive, since a square root has no derivative at zero.
        const Float sines = dr::sqrt(dr::maximum((1.f - q_squared) * (1.f - q0_squared), SINES_SQUARED_MIN));
        // The tangential parts of `-from` and `to` have the scalar product q q0 - from·to = 1 + q q0 - half.
        const Float cos         = dr::clip((1.f + product - half) / sines, -1.f, 1.f);
        const Float cos_squared = cos * cos, sin_squared = 1.f - cos_squared;
        if (m_perfect) {
            const Float grazing    = (q_squared + q0_squared + product - q_squared * q0_squared - half) / sines;
            const Float difference = dr::select(sines < SINES_GRAZING, cos - sines, grazing);
            // |B_pp|² + |B_ss|² and |B_sp|² + |B_ps|², times (q q0)².
            const Float straight = dr::fmadd(difference, difference, cos_squared * product * product);
            const Float crossed  = sin_squared * (q_squared + q0_squared);
            // Q; its factor 2 q q0 / w² is here divided by (q q0)².
            return UnpolarizedSpectrum(2.f * (straight + crossed) / (product * w * w));
        }
        const Terms out(q, m_epsilon), in(q0, m_epsilon);
        // Reciprocal squared moduli of the denominators.
        auto rcp_squared = [](const Complex &z) {
            return dr::rcp(dr::maximum(dr::squared_norm(z), DIVISOR_SQUARED_MIN));
        };
        const UnpolarizedSpectrum per_d_s = rcp_squared(out.d_s), per_d_s0 = rcp_squared(in.d_s),
                                  per_d_p = rcp_squared(out.d_p), per_d_p0 = rcp_squared(in.d_p);
        // Numerator of B_pp without the factor ε − 1.
        const Complex pp = out.t * in.t * UnpolarizedSpectrum(cos) - m_epsilon * UnpolarizedSpectrum(sines);
        // |B_ss|² + |B_pp|² and |B_sp|² + |B_ps|², over |ε − 1|².
        const UnpolarizedSpectrum straight =
            cos_squared * per_d_s * per_d_s0 + dr::squared_norm(pp) * per_d_p * per_d_p0;
        const UnpolarizedSpectrum crossed =
            sin_squared * (dr::squared_norm(out.t) * per_d_p * per_d_s0 + dr::squared_norm(in.t) * per_d_p0 * per_d_s);
        return dr::squared_norm(m_epsilon - 1.f) * (straight + crossed) * (2.f * product / (w * w));
    }

    /// Mueller matrix of the amplitudes that `small_slope_amplitudes` in src/scattering/small_slope.rs computes.
    /// The first axes of its frames of reference are the s axes: z × `azimuth.in` for the incident light and
    /// z × `azimuth.out` for the outgoing light.
    Spectrum small_slope_matrix(const Vector3f &from, const Vector3f &to, const Azimuth &azimuth) const {
        const Float q0 = cosine(from), q = cosine(to), product = q * q0, w = q + q0;
        // Square of the common factor 2 √(q q0) / w of the amplitudes.
        const UnpolarizedSpectrum scale(4.f * product / (w * w));
        const UnpolarizedSpectrum cos(azimuth.cos()), sin(azimuth.sin());
        const Float sines_squared =
            (dr::square(from.x()) + dr::square(from.y())) * (dr::square(to.x()) + dr::square(to.y()));
        const UnpolarizedSpectrum sines(dr::sqrt(dr::maximum(sines_squared, ROOT_MIN)));
        if (m_perfect) {
            const Float half = half_squared_length(from, to, w);
            // All wavelengths have the same sines.
            const Float grazing =
                (q * q + q0 * q0 + product - product * product - half) / dr::maximum(Float(sines[0]), SINES_MIN);
            const UnpolarizedSpectrum pp =
                dr::select(sines > SINES_GRAZING, UnpolarizedSpectrum(grazing), cos - sines) / product;
            return scale * jones_to_mueller(Complex(-cos), Complex(sin / q0), Complex(sin / q), Complex(pp));
        }
        const Terms out(q, m_epsilon), in(q0, m_epsilon);
        const Complex contrast = m_epsilon - 1.f;
        return scale * jones_to_mueller(-contrast * cos / (out.d_s * in.d_s),
                                        contrast * in.t * sin / (out.d_s * in.d_p),
                                        contrast * out.t * sin / (out.d_p * in.d_s),
                                        contrast * (out.t * in.t * cos - m_epsilon * sines) / (out.d_p * in.d_p));
    }

    /// Complex index eta + ik, and its square ε.
    Complex m_index, m_epsilon;
    bool m_small_slope, m_perfect;
};

} // namespace sunbeam
