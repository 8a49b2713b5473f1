// Implementation of the helpers for the tests of tracing. Exceptions must not reach Rust, so `attempt` catches them.
#include "jit_tests.h"

#include <exception>

#include <drjit/jit.h>

namespace sunbeam::jit {
namespace {

/// Result of `call`; `failed` if it throws.
template <typename T, typename Call> T attempt(T failed, const Call &call) noexcept {
    try {
        return call();
    } catch (const std::exception &) {
        return failed;
    }
}

} // namespace

uint32_t llvm_backend() noexcept {
    return attempt(0u, [] {
        jit_set_log_level_stderr(LogLevel::Warn);
        jit_init();
        return jit_has_backend(JitBackend::LLVM) ? uint32_t(JitBackend::LLVM) : 0u;
    });
}

uint32_t upload(uint32_t backend, rust::Slice<const uint32_t> words) noexcept {
    using Words = drjit::LLVMArray<uint32_t>;
    return attempt(0u, [&] {
        return JitBackend(backend) == JitBackend::LLVM ? Words::load_(words.data(), words.size()).release() : 0u;
    });
}

bool download(uint32_t index, rust::Slice<uint32_t> words) noexcept {
    return attempt(false, [&] {
        jit_var_eval(index);
        // A variable of size 1 has its value in every lane.
        const bool repeated = jit_var_size(index) == 1;
        for (size_t i = 0; i < words.size(); ++i)
            jit_var_read(index, repeated ? 0 : i, &words[i]);
        return true;
    });
}

void set_symbolic_loops(bool on) noexcept {
    jit_set_flag(JitFlag::SymbolicLoops, on);
}

uint32_t references(uint32_t index) noexcept {
    return attempt(0u, [&] { return jit_var_ref(index); });
}

rust::String all_variables() noexcept {
    return attempt(rust::String(), [] { return rust::String::lossy(jit_var_whos()); });
}

} // namespace sunbeam::jit
