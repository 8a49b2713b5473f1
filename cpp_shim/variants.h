// Registration of the plugin's variants. Each backend is a translation unit of its own, so that they compile in
// parallel.
#pragma once

#include <string_view>

#include <mitsuba/core/object.h>

namespace sunbeam {

size_t register_scalar_variants(std::string_view name, mitsuba::PluginRegisterFn fn);
size_t register_llvm_variants(std::string_view name, mitsuba::PluginRegisterFn fn);
size_t register_cuda_variants(std::string_view name, mitsuba::PluginRegisterFn fn);

/// A function of the running Mitsuba's core library; set before any instance is made.
extern const void *mitsuba_address;

} // namespace sunbeam
