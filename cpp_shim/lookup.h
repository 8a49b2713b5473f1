// The diffraction lobe itself: the one place that knows the physics.
//
// PLACEHOLDER: a Lambertian of albedo 1, until the tables of the Rust core are behind it.
#pragma once

#include <utility>

#include <mitsuba/core/warp.h>
#include <mitsuba/render/bsdf.h>

#include "sunbeam/src/mitsuba_plugin.rs.h"

namespace sunbeam {

/// Value and density of the lobe for a pair of directions; the value contains cosθo and no Fresnel reflectance.
template <typename Float, typename UnpolarizedSpectrum> struct LobeValue {
    UnpolarizedSpectrum value;
    Float pdf;
};

/// Diffraction by one surface. Directions are in the grating's frame and point away from the surface; both cosines
/// are positive where `active` holds. Wavelengths are in nm in spectral variants and empty in the others.
template <typename Float, typename Spectrum> class DiffractionLobe {
public:
    using UnpolarizedSpectrum = mitsuba::unpolarized_spectrum_t<Spectrum>;
    using Wavelength          = mitsuba::wavelength_t<Spectrum>;
    using Vector3f            = mitsuba::Vector<Float, 3>;
    using Point2f             = mitsuba::Point<Float, 2>;
    using Mask                = drjit::mask_t<Float>;
    using Value               = LobeValue<Float, UnpolarizedSpectrum>;

    explicit DiffractionLobe(rust::Box<Surface> surface) : m_surface(std::move(surface)) {}

    Value eval_pdf(const Vector3f & /*wi*/, const Vector3f &wo, const Wavelength & /*wavelengths*/,
                   Mask /*active*/) const {
        const Float pdf = mitsuba::warp::square_to_cosine_hemisphere_pdf(wo);
        return { UnpolarizedSpectrum(pdf), pdf };
    }

    /// A direction from three uniform variates; its density is that of `eval_pdf`.
    Vector3f sample(const Vector3f & /*wi*/, const Wavelength & /*wavelengths*/, const Float & /*sample1*/,
                    const Point2f &sample2, Mask /*active*/) const {
        return mitsuba::warp::square_to_cosine_hemisphere(sample2);
    }

    std::string describe() const { return std::string(m_surface->describe()); }

private:
    rust::Box<Surface> m_surface;
};

} // namespace sunbeam
