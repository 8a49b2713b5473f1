// Calls of Dr.Jit's C functions on behalf of Rust. Every exception is caught here and kept as a message.
#include "jit.h"

#include <cstdio>
#include <exception>
#include <string_view>

#include <drjit-core/jit.h>
#include <drjit-core/nanostl.h>
#include <drjit/autodiff.h>

#include "sunbeam_mitsuba/src/jit.rs.h"

namespace sunbeam::jit {
namespace {

/// Message of this thread's first error, a C string; empty if there is none. The buffer has a fixed size, because
/// memory may have run out. Longer messages are cut.
thread_local char first_error[1024] = "";

/// Stores a message in `first_error` unless it holds one.
void keep(std::string_view message) {
    if (*first_error)
        return;
    if (message.empty())
        message = "an error without a message";
    std::snprintf(first_error, sizeof first_error, "%.*s", int(message.size()), message.data());
}

/// Exception that unwinds Dr.Jit's frames after a callback of a loop has failed. Rust has stored the reason.
struct Abandoned : std::exception {
    const char *what() const noexcept override { return "a loop's body failed"; }
};

/// Result of `call`; `failed` if it throws.
template <typename T, typename Call> T guarded(T failed, const Call &call) noexcept {
    try {
        return call();
    } catch (const Abandoned &) {
        // Rust reports the reason: it has called `keep_error`, or resumes its panic.
    } catch (const std::exception &error) {
        keep(error.what());
    } catch (...) {
        keep("an exception of an unknown kind");
    }
    return failed;
}

/// Index of the result of a Dr.Jit function, applied to the variables `indices`; 0 if it throws or an index is 0.
template <typename Function, typename... Index> uint32_t traced(Function function, Index... indices) noexcept {
    if (((indices == 0) || ...)) {
        keep("an operand is not a variable");
        return 0;
    }
    return guarded(0u, [&] { return function(indices...); });
}

/// Converts the values of a variable to a type. With `reinterpret` it keeps their bits instead of their values.
uint32_t cast(uint32_t index, VarType type, bool reinterpret) noexcept {
    return traced([&](uint32_t i) { return jit_var_cast(i, type, reinterpret); }, index);
}

/// Abandons a loop if its last callback did not succeed, or if an error is stored.
void abandon_unless(bool succeeded) {
    if (!succeeded || *first_error)
        throw Abandoned();
}

} // namespace

// Dr.Jit's reference counts do not throw.
uint32_t retain(uint32_t index) noexcept {
    return jit_var_inc_ref(index);
}
void release(uint32_t index) noexcept {
    jit_var_dec_ref(index);
}

uint32_t constant_f32(uint32_t backend, float value) noexcept {
    return guarded(0u, [&] { return jit_var_f32(JitBackend(backend), value); });
}
uint32_t constant_f64(uint32_t backend, double value) noexcept {
    return guarded(0u, [&] { return jit_var_f64(JitBackend(backend), value); });
}
uint32_t constant_u32(uint32_t backend, uint32_t value) noexcept {
    return guarded(0u, [&] { return jit_var_u32(JitBackend(backend), value); });
}
uint32_t constant_bool(uint32_t backend, bool value) noexcept {
    return guarded(0u, [&] { return jit_var_bool(JitBackend(backend), value); });
}

// Definitions of the operations that jit.h declares.
#define UNARY(name, function)                                                                                          \
    uint32_t name(uint32_t a) noexcept {                                                                               \
        return traced(function, a);                                                                                    \
    }
#define BINARY(name, function)                                                                                         \
    uint32_t name(uint32_t a, uint32_t b) noexcept {                                                                   \
        return traced(function, a, b);                                                                                 \
    }
#define TERNARY(name, function)                                                                                        \
    uint32_t name(uint32_t a, uint32_t b, uint32_t c) noexcept {                                                       \
        return traced(function, a, b, c);                                                                              \
    }
SUNBEAM_JIT_OPERATIONS(UNARY, BINARY, TERNARY)
#undef UNARY
#undef BINARY
#undef TERNARY

uint32_t to_f32(uint32_t a) noexcept {
    return cast(a, VarType::Float32, false);
}
uint32_t to_f64(uint32_t a) noexcept {
    return cast(a, VarType::Float64, false);
}
uint32_t to_u32(uint32_t a) noexcept {
    return cast(a, VarType::UInt32, false);
}
uint32_t f32_from_bits(uint32_t a) noexcept {
    return cast(a, VarType::Float32, true);
}

void gather(uint32_t source, uint32_t at, uint32_t mask, rust::Slice<uint32_t> indices) noexcept {
    // Zeros tell the caller of an error.
    for (uint32_t &index : indices)
        index = 0;
    // A single element is no packet.
    if (indices.size() == 1) {
        indices[0] = traced(jit_var_gather, source, at, mask);
        return;
    }
    // The results go to `indices`; the number that `traced` returns has no meaning.
    traced(
        [&](uint32_t source, uint32_t at, uint32_t mask) {
            jit_var_gather_packet(indices.size(), source, at, mask, indices.data());
            return 0u;
        },
        source, at, mask);
}

bool run_loop(uint32_t backend, const char *name, Loop &loop) noexcept {
    // −1: Dr.Jit's flags decide whether the loop is symbolic.
    constexpr int SYMBOLIC = -1;
    // −1: Dr.Jit's flags decide whether an evaluated loop drops finished lanes.
    constexpr int COMPRESS = -1;
    // 0: no limit is known.
    constexpr long long MAX_ITERATIONS = 0;
    // Dr.Jit keeps a differentiable loop beyond this call; `loop` lives only as long as the call.
    constexpr bool DIFFERENTIABLE = false;

    // Callbacks of Dr.Jit; their payload is `loop` (src/jit.rs). `read` appends a new reference to each variable of the
    // loop's state, and `write` replaces these variables. `condition` returns the mask of the lanes that go on, and
    // `body` computes the next state.
    const auto read = [](void *payload, drjit::vector<uint64_t> &indices) {
        rust::Vec<uint32_t> state;
        static_cast<Loop *>(payload)->read(state);
        for (uint32_t index : state)
            indices.push_back(index);
    };
    // Must not throw, because Dr.Jit also calls it while it unwinds. The unused `bool` is set when a loop restarts.
    const auto write = [](void *payload, const drjit::vector<uint64_t> &indices, bool) {
        rust::Vec<uint32_t> state;
        for (size_t i = 0; i < indices.size(); ++i)
            state.push_back(uint32_t(indices[i]));
        static_cast<Loop *>(payload)->write({ state.data(), state.size() });
    };
    const auto condition = [](void *payload) {
        const uint32_t index = static_cast<Loop *>(payload)->condition();
        abandon_unless(index != 0);
        return index;
    };
    const auto body = [](void *payload) { abandon_unless(static_cast<Loop *>(payload)->body()); };
    // The caller owns `loop`.
    const auto destroy = [](void *) {};
    return guarded(false, [&] {
        // An earlier error may have left invalid variables in the state.
        if (*first_error)
            throw Abandoned();
        ad_loop(JitBackend(backend), SYMBOLIC, COMPRESS, MAX_ITERATIONS, name, &loop, read, write, condition, body,
                destroy, DIFFERENTIABLE);
        return true;
    });
}

void keep_error(rust::Str message) noexcept {
    keep({ message.data(), message.size() });
}

rust::String take_error() noexcept {
    const rust::String message = rust::String::lossy(first_error);
    *first_error               = 0;
    return message;
}

} // namespace sunbeam::jit
