// Functions that the Rust tests of tracing (src/traced/tests.rs) need beside those of jit.h. The plugin does not use
// them, so they are not linked into it.
#pragma once

#include <cstdint>

#include "rust/cxx.h"

namespace sunbeam::jit {

/// Initialises Dr.Jit and returns its LLVM backend as a `JitBackend`; 0 if the backend is not available.
uint32_t llvm_backend() noexcept;
/// Makes an array of the LLVM backend that holds `words`. Returns its index with a reference that the caller owns, or 0
/// for another backend or an error.
uint32_t upload(uint32_t backend, rust::Slice<const uint32_t> words) noexcept;
/// Evaluates a variable of 32-bit elements and copies its first `words.size()` elements to `words`. A single element is
/// repeated. Returns false after an error.
bool download(uint32_t index, rust::Slice<uint32_t> words) noexcept;
/// Selects symbolic loops (true) or evaluated loops (false).
void set_symbolic_loops(bool on) noexcept;
/// Number of references to a variable; 0 if there is no variable with this index.
uint32_t references(uint32_t index) noexcept;
/// Dr.Jit's listing of all variables. Its number of lines grows by one with each variable.
rust::String all_variables() noexcept;

} // namespace sunbeam::jit
