// Variants of Dr.Jit's LLVM backend, all differentiable: mono and spectral, with and without polarisation, and RGB.
#include "diffraction.h"
#include "variants.h"

namespace sunbeam {

size_t register_llvm_variants(std::string_view name, mitsuba::PluginRegisterFn fn) {
    return register_jit_variants<mitsuba::dr::DiffArray<JitBackend::LLVM, float>>(name, fn);
}

} // namespace sunbeam
