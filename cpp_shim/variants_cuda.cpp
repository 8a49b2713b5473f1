// Variants of Dr.Jit's CUDA backend, all differentiable: mono and spectral, with and without polarisation, and RGB.
#include "diffraction.h"
#include "variants.h"

namespace sunbeam {

size_t register_cuda_variants(std::string_view name, mitsuba::PluginRegisterFn fn) {
    return register_jit_variants<mitsuba::dr::DiffArray<JitBackend::CUDA, float>>(name, fn);
}

} // namespace sunbeam
