// Rotation of the relief about the normal.
#pragma once

#include <mitsuba/core/vector.h>

namespace sunbeam {

namespace dr = drjit;

/// Sine and cosine of the relief's rotation, counter-clockwise from the tangent dp/du, seen from the normal's side.
template <typename Float> struct Rotation {
    using Vector3f = mitsuba::Vector<Float, 3>;

    Float sin, cos;

    /// A rotation by an angle in degrees.
    static Rotation degrees(const Float &angle) {
        const auto [sin, cos] = dr::sincos(dr::deg_to_rad(angle));
        return { sin, cos };
    }

    /// Converts a vector from the shading frame to the relief's frame.
    Vector3f to_relief(const Vector3f &w) const {
        return { dr::fmadd(cos, w.x(), sin * w.y()), dr::fmadd(cos, w.y(), -sin * w.x()), w.z() };
    }

    /// Converts a vector from the relief's frame to the shading frame.
    Vector3f to_shading(const Vector3f &w) const {
        return { dr::fmadd(cos, w.x(), -sin * w.y()), dr::fmadd(cos, w.y(), sin * w.x()), w.z() };
    }

    /// First axis of the frame of polarisation for light along the unit vector `w`, both in the shading frame: the
    /// grooves' direction, the relief's y, without its component along `w`. Normalised; 0 for `w` along the grooves.
    Vector3f groove_axis(const Vector3f &w) const {
        // The square of an angle of 1e-6 between `w` and the grooves. At smaller angles rounding in single precision
        // alone would set the axis.
        constexpr float SQUARED_LENGTH_MIN = 1e-12f;
        const Vector3f grooves             = to_shading({ 0.f, 1.f, 0.f });
        const Vector3f axis                = dr::fnmadd(w, dr::dot(grooves, w), grooves);
        return axis * dr::rsqrt(dr::maximum(dr::squared_norm(axis), SQUARED_LENGTH_MIN));
    }
};

} // namespace sunbeam
