// Dr.Jit's functions for tracing from Rust (src/jit.rs), in a form that crosses the boundary.
//
// A variable is an index. Arguments are borrowed; results belong to the caller. Index 0 is no variable: an operation on
// it returns 0, as does one that fails, so that a failure propagates. The first failure's message is kept for
// `take_error`. Nothing here throws.
//
// Names, numbers and signatures of Dr.Jit come from the wheel's headers, and Rust knows none of them. Only functions
// common to releases 1.2 to 1.5 are used.
#pragma once

#include <cstdint>

#include "rust/cxx.h"

namespace sunbeam::jit {

/// A loop being traced; src/jit.rs defines it.
struct Loop;

/// Takes a new reference to a variable and returns its index.
uint32_t retain(uint32_t index) noexcept;
/// Gives a reference back.
void release(uint32_t index) noexcept;

/// Constants of a backend, which is a `JitBackend`.
uint32_t constant_f32(uint32_t backend, float value) noexcept;
uint32_t constant_f64(uint32_t backend, double value) noexcept;
uint32_t constant_u32(uint32_t backend, uint32_t value) noexcept;
uint32_t constant_bool(uint32_t backend, bool value) noexcept;

/// Operations on variables, with Dr.Jit's function for each. Arguments of one operation have one type; `fma(a, b, c)`
/// is `a·b + c`, `select(mask, yes, no)` takes a mask first.
#define SUNBEAM_JIT_OPERATIONS(UNARY, BINARY, TERNARY)                                                                 \
    BINARY(add, jit_var_add)                                                                                           \
    BINARY(sub, jit_var_sub)                                                                                           \
    BINARY(mul, jit_var_mul)                                                                                           \
    BINARY(div, jit_var_div)                                                                                           \
    BINARY(min, jit_var_min)                                                                                           \
    BINARY(max, jit_var_max)                                                                                           \
    TERNARY(fma, jit_var_fma)                                                                                          \
    UNARY(neg, jit_var_neg)                                                                                            \
    UNARY(abs, jit_var_abs)                                                                                            \
    UNARY(sqrt, jit_var_sqrt)                                                                                          \
    UNARY(floor, jit_var_floor)                                                                                        \
    UNARY(ceil, jit_var_ceil)                                                                                          \
    UNARY(exp2, jit_var_exp2)                                                                                          \
    UNARY(log2, jit_var_log2)                                                                                          \
    BINARY(lt, jit_var_lt)                                                                                             \
    BINARY(le, jit_var_le)                                                                                             \
    BINARY(bit_and, jit_var_and)                                                                                       \
    BINARY(bit_or, jit_var_or)                                                                                         \
    UNARY(bit_not, jit_var_not)                                                                                        \
    BINARY(shl, jit_var_shl)                                                                                           \
    BINARY(shr, jit_var_shr)                                                                                           \
    TERNARY(select, jit_var_select)

#define UNARY(name, function) uint32_t name(uint32_t a) noexcept;
#define BINARY(name, function) uint32_t name(uint32_t a, uint32_t b) noexcept;
#define TERNARY(name, function) uint32_t name(uint32_t a, uint32_t b, uint32_t c) noexcept;
SUNBEAM_JIT_OPERATIONS(UNARY, BINARY, TERNARY)
#undef UNARY
#undef BINARY
#undef TERNARY

/// Conversions of values. To an integer: towards zero; numbers out of range differ between backends.
uint32_t to_f32(uint32_t a) noexcept;
uint32_t to_f64(uint32_t a) noexcept;
uint32_t to_u32(uint32_t a) noexcept;
/// Reinterprets 32 bits as a number of single precision.
uint32_t f32_from_bits(uint32_t a) noexcept;

/// Reads `W = indices.size()` elements (1, 2 or 4) of `source` from `W·at` on; zeros where the mask is false.
void gather(uint32_t source, uint32_t at, uint32_t mask, rust::Slice<uint32_t> indices) noexcept;

/// Runs a loop, symbolically or evaluated as Dr.Jit's flags say. Returns false if it failed or was abandoned.
bool run_loop(uint32_t backend, const char *name, Loop &loop) noexcept;

/// Keeps a message unless one is kept.
void keep_error(rust::Str message) noexcept;
/// The first message since the last call; empty if there is none.
rust::String take_error() noexcept;

} // namespace sunbeam::jit
