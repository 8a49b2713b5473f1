// Scalar variants, which do without Dr.Jit's backends: RGB, and spectral with and without polarisation.
#include "diffraction.h"
#include "variants.h"

namespace sunbeam {

size_t register_scalar_variants(std::string_view name, mitsuba::PluginRegisterFn fn) {
    using Float    = float;
    using RGB      = mitsuba::Color<Float, 3>;
    using Spectral = mitsuba::Spectrum<Float, 4>;
    return register_variant<Float, RGB>(name, fn) + register_variant<Float, Spectral>(name, fn) +
           register_variant<Float, mitsuba::MuellerMatrix<Spectral>>(name, fn);
}

} // namespace sunbeam
