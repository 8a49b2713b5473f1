// The functions of Dr.Jit that Rust traces with (src/jit.rs), in a form that can cross the boundary.
//
// A variable is an index. Arguments are borrowed, results belong to the caller. Index 0 is no variable: any function
// that is given one gives 0, and so does one that fails, so that a failure runs through what is computed from it. The
// first failure's message is kept for `take_error`. Nothing here throws.
//
// What types are called and how functions are declared, the headers of the wheel say: Rust knows neither names nor
// numbers of Dr.Jit. Only functions that releases 1.2 to 1.5 have in common are used.
#pragma once

#include <cstdint>

#include "rust/cxx.h"

namespace sunbeam::jit {

/// A loop being traced; src/jit.rs defines it.
struct Loop;

/// A new reference to a variable, and its return.
uint32_t retain(uint32_t index) noexcept;
void release(uint32_t index) noexcept;

/// Constants. `backend` is a `JitBackend`.
uint32_t constant_f32(uint32_t backend, float value) noexcept;
uint32_t constant_f64(uint32_t backend, double value) noexcept;
uint32_t constant_u32(uint32_t backend, uint32_t value) noexcept;
uint32_t constant_bool(uint32_t backend, bool value) noexcept;

/// Arithmetic; both arguments have the same type.
uint32_t add(uint32_t a, uint32_t b) noexcept;
uint32_t sub(uint32_t a, uint32_t b) noexcept;
uint32_t mul(uint32_t a, uint32_t b) noexcept;
uint32_t div(uint32_t a, uint32_t b) noexcept;
uint32_t min(uint32_t a, uint32_t b) noexcept;
uint32_t max(uint32_t a, uint32_t b) noexcept;
/// `a·b + c`.
uint32_t fma(uint32_t a, uint32_t b, uint32_t c) noexcept;
uint32_t neg(uint32_t a) noexcept;
uint32_t abs(uint32_t a) noexcept;
uint32_t sqrt(uint32_t a) noexcept;
uint32_t floor(uint32_t a) noexcept;
uint32_t ceil(uint32_t a) noexcept;
uint32_t exp2(uint32_t a) noexcept;
uint32_t log2(uint32_t a) noexcept;

/// Truth values, and bits of integers.
uint32_t lt(uint32_t a, uint32_t b) noexcept;
uint32_t le(uint32_t a, uint32_t b) noexcept;
uint32_t bit_and(uint32_t a, uint32_t b) noexcept;
uint32_t bit_or(uint32_t a, uint32_t b) noexcept;
uint32_t bit_not(uint32_t a) noexcept;
uint32_t shl(uint32_t a, uint32_t by) noexcept;
uint32_t shr(uint32_t a, uint32_t by) noexcept;
uint32_t select(uint32_t mask, uint32_t yes, uint32_t no) noexcept;

/// Conversions. To an integer: towards zero, of a number that is representable; others differ between backends.
uint32_t to_f32(uint32_t a) noexcept;
uint32_t to_f64(uint32_t a) noexcept;
uint32_t to_u32(uint32_t a) noexcept;
/// The same bits as another type.
uint32_t f32_from_bits(uint32_t a) noexcept;

/// Reads `W = indices.size()` elements (1, 2 or 4) of `source` from `W·at` on; zeros where the mask is false.
void gather(uint32_t source, uint32_t at, uint32_t mask, rust::Slice<uint32_t> indices) noexcept;

/// Runs a loop, symbolically or evaluated as Dr.Jit's flags say. False when it failed or was abandoned.
bool run_loop(uint32_t backend, const char *name, Loop &loop) noexcept;

/// Keeps a message unless one is kept.
void keep_error(rust::Str message) noexcept;
/// The first message since the last call, empty if there is none.
rust::String take_error() noexcept;

} // namespace sunbeam::jit
