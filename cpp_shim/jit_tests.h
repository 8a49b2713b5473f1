// Helpers of the Rust tests of tracing, beside jit.h. The plugin does not use them, so they are not linked into it.
#pragma once

#include <cstdint>

#include "rust/cxx.h"

namespace sunbeam::jit {

/// The backend without a GPU, 0 where it does not work.
uint32_t llvm_backend() noexcept;
/// An array of words of that backend, 0 if there is no memory for it.
uint32_t upload(uint32_t backend, rust::Slice<const uint32_t> words) noexcept;
/// Computes a variable of 32-bit elements and copies them out; a single element is repeated. False if that failed.
bool download(uint32_t index, rust::Slice<uint32_t> words) noexcept;
void set_symbolic_loops(bool on) noexcept;
/// References to a variable, 0 if there is none of this index.
uint32_t references(uint32_t index) noexcept;
/// A table of all variables; empty lines apart, as many rows as variables.
rust::String all_variables() noexcept;

} // namespace sunbeam::jit
