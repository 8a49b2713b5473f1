// Registration of the plugin's variants. Each backend has a source file of its own, so that they compile in parallel.
#pragma once

#include <string_view>

#include <mitsuba/core/object.h>

namespace sunbeam {

/// Each function registers the plugin `name` with Mitsuba's function `fn` for all variants of one backend, and returns
/// the number of variants. Scalar variants need no backend.
size_t register_scalar_variants(std::string_view name, mitsuba::PluginRegisterFn fn);
size_t register_llvm_variants(std::string_view name, mitsuba::PluginRegisterFn fn);
size_t register_cuda_variants(std::string_view name, mitsuba::PluginRegisterFn fn);

/// Address of a function in the running Mitsuba's core library, for `require_compatible` (checks.h). diffraction.cpp
/// sets it when Mitsuba loads the plugin, before any instance is made.
extern const void *mitsuba_address;

} // namespace sunbeam
