// Registration of the plugin's variants. Each backend is a translation unit of its own and compiles in parallel.
#pragma once

#include <string_view>

#include <mitsuba/core/object.h>

namespace sunbeam {

/// Registers the variants of one backend and returns their number.
size_t register_scalar_variants(std::string_view name, mitsuba::PluginRegisterFn fn);
size_t register_llvm_variants(std::string_view name, mitsuba::PluginRegisterFn fn);
size_t register_cuda_variants(std::string_view name, mitsuba::PluginRegisterFn fn);

/// Address of a function in the running Mitsuba's core library; set before any instance is made.
extern const void *mitsuba_address;

} // namespace sunbeam
