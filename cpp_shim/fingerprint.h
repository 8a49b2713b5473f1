// Fingerprint of traced code. Dr.Jit records ("traces") a call into a kernel, and a frozen function (`dr.freeze`)
// replays its kernels. A changed fingerprint tells it that they no longer fit a BSDF, so it records new ones.
#pragma once

#include <array>
#include <cstdint>

#include <drjit/traversable_base.h>

namespace sunbeam {

namespace dr = drjit;

/// The lower 32 bits of a number that identifies traced code (`code` in optics.h), encoded in types that frozen
/// functions compare.
///
/// Sizes and layouts of tables are constants of the traced code, so a kernel fits one set of tables. A frozen function
/// compares the number of its inputs, their types, and the values of literals. A literal whose value has changed once
/// becomes an input, and its value is not compared again. Types are always compared. Therefore each base-four digit of
/// the number is reported as a zero of one of four types.
template <typename Float> class Fingerprint {
public:
    explicit Fingerprint(uint64_t number) : m_number(number) {}

    /// Reports the digits to Dr.Jit, the least significant first. The two texts that `fn` takes are for classes only.
    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro fn) const {
        each_digit([&](uint64_t literal) { fn(payload, literal, "", ""); });
    }
    /// Reports the digits and ignores the replacements that `fn` returns: the literals stay zero.
    void traverse_1_cb_rw(void *payload, dr::detail::traverse_callback_rw fn) const {
        each_digit([&](uint64_t literal) { fn(payload, literal, "", ""); });
    }

private:
    /// Number of base-four digits, two bits each.
    static constexpr size_t DIGITS = 16;

    /// Calls `visit` with the Dr.Jit index of each digit's literal: type d of the four stands for the digit d.
    template <typename Visit> void each_digit(const Visit &visit) const {
        const std::array<uint64_t, 4> literals{ m_u32.index_combined(), m_i32.index_combined(), m_u64.index_combined(),
                                                m_i64.index_combined() };
        for (size_t i = 0; i < DIGITS; ++i)
            visit(literals[(m_number >> (2 * i)) & 3]);
    }

    uint64_t m_number;
    dr::uint32_array_t<Float> m_u32{ 0 };
    dr::int32_array_t<Float> m_i32{ 0 };
    dr::uint64_array_t<Float> m_u64{ 0 };
    dr::int64_array_t<Float> m_i64{ 0 };
};

} // namespace sunbeam
