// Dr.Jit's functions for tracing from Rust (src/jit.rs), with arguments that can cross the boundary of languages.
//
// Variables are identified by their Dr.Jit index. A variable is an array, and a *lane* is one position in all arrays of
// a kernel. Functions borrow the variables of their arguments, and the caller owns a reference to each result. Index 0
// stands for no variable. An operation that fails, or has the operand 0, returns 0, so a failure propagates. Each
// thread keeps its first error message for `take_error`. Nothing here throws.
//
// Rust uses only the functions below, and this file needs nothing from Dr.Jit's headers. The implementation calls only
// functions of Dr.Jit that releases 1.2 to 1.5 have.
#pragma once

#include <cstdint>

#include "rust/cxx.h"

namespace sunbeam::jit {

/// State, condition and body of a loop that is being traced; defined in src/jit.rs.
struct Loop;

/// Takes a new reference to a variable and returns its index.
uint32_t retain(uint32_t index) noexcept;
/// Releases a reference to a variable.
void release(uint32_t index) noexcept;

/// Variables with one constant element. `backend` is the number of a `JitBackend`, the enumeration of Dr.Jit.
uint32_t constant_f32(uint32_t backend, float value) noexcept;
uint32_t constant_f64(uint32_t backend, double value) noexcept;
uint32_t constant_u32(uint32_t backend, uint32_t value) noexcept;
uint32_t constant_bool(uint32_t backend, bool value) noexcept;

/// List of the operations on variables: their name here, and Dr.Jit's function. All operands of an operation have the
/// same type, except the mask of `select(mask, yes, no)`. `fma(a, b, c)` is `a·b + c`. Results of `lt` and `le` are
/// masks. The operands of `bit_and`, `bit_or` and `bit_not` are masks or integers. Those of `shl(a, bits)` and
/// `shr(a, bits)` are integers.
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

// Declares each operation of the list.
#define UNARY(name, function) uint32_t name(uint32_t a) noexcept;
#define BINARY(name, function) uint32_t name(uint32_t a, uint32_t b) noexcept;
#define TERNARY(name, function) uint32_t name(uint32_t a, uint32_t b, uint32_t c) noexcept;
SUNBEAM_JIT_OPERATIONS(UNARY, BINARY, TERNARY)
#undef UNARY
#undef BINARY
#undef TERNARY

/// Conversions of values. `to_u32` rounds towards zero; its result for numbers outside [0, 2^32) depends on the
/// backend.
uint32_t to_f32(uint32_t a) noexcept;
uint32_t to_f64(uint32_t a) noexcept;
uint32_t to_u32(uint32_t a) noexcept;
/// Reinterprets the bits of a 32-bit integer as a single-precision number.
uint32_t f32_from_bits(uint32_t a) noexcept;

/// Reads consecutive elements of the array `source`. Each lane of `at` reads `W = indices.size()` elements, 1, 2 or 4,
/// from element `W·at` on. Element `i` of all lanes becomes one variable, whose index is written to `indices[i]`; 0
/// on failure. Elements are zero where the mask is false.
void gather(uint32_t source, uint32_t at, uint32_t mask, rust::Slice<uint32_t> indices) noexcept;

/// Runs a loop. Dr.Jit's flags decide whether it is recorded (symbolic) or executed step by step (evaluated). `name` is
/// a label that must live forever, since Dr.Jit keeps the pointer. Returns false if Dr.Jit or a callback of `loop`
/// failed.
bool run_loop(uint32_t backend, const char *name, Loop &loop) noexcept;

/// Stores an error message of this thread unless one is stored.
void keep_error(rust::Str message) noexcept;
/// Returns this thread's stored message and clears it; empty if there is none.
rust::String take_error() noexcept;

} // namespace sunbeam::jit
