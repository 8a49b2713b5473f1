// Table data of a surface in a backend's memory.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include <drjit/traversable_base.h>
#include <mitsuba/render/bsdf.h>

#include "sunbeam_mitsuba/src/bridge.rs.h"

namespace sunbeam {

namespace dr = drjit;

/// Table data of a surface as Dr.Jit arrays of words, from which kernels gather. A word is a `u32`: an integer, or the
/// bits of a single-precision number. `Float` is an array of Dr.Jit: scalar variants read the tables in Rust instead.
///
/// Surfaces with the same tables share one copy in all variants with the same `Float`.
template <typename Float> class Buffers {
public:
    /// Number of arrays of a surface, one for each kind of table (`Surface::words` in cpp_shim/src/bridge.rs). Tables
    /// that a surface lacks are empty arrays. `TracedQuery::words` must have the same length: otherwise its assignment
    /// in lobe.h does not compile.
    static constexpr size_t COUNT = 3;

    explicit Buffers(const Surface &surface) : m_arrays(shared_arrays(surface)) {}

    /// Dr.Jit indices of the arrays, valid while this object lives; 0 for an empty array. They are the lower halves of
    /// `index_combined`. The upper halves identify derivatives, which tables do not have.
    std::array<uint32_t, COUNT> indices() const {
        std::array<uint32_t, COUNT> result;
        for (size_t i = 0; i < COUNT; ++i)
            result[i] = (*m_arrays)[i].index();
        return result;
    }

    /// Reports the arrays to Dr.Jit as inputs of a frozen function (`dr.freeze`), which records kernels and replays
    /// them. Dr.Jit prescribes the name. The empty texts stand for classes of virtual calls, which have no part here.
    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro fn) const {
        for (const UInt32X &array : *m_arrays)
            fn(payload, array.index_combined(), "", "");
    }
    /// Reports the arrays and ignores the replacements that `fn` returns: kernels never write tables, and other threads
    /// may be reading the shared arrays.
    void traverse_1_cb_rw(void *payload, dr::detail::traverse_callback_rw fn) const {
        for (const UInt32X &array : *m_arrays)
            fn(payload, array.index_combined(), "", "");
    }

private:
    using UInt32X = mitsuba::DynamicBuffer<dr::uint32_array_t<Float>>;
    using Arrays  = std::array<UInt32X, COUNT>;

    /// Largest number of words that one gather reads (`gather` of jit.h). Dr.Jit requires arrays whose length is a
    /// multiple of this number.
    static constexpr size_t PACKET_WORDS = 4;

    /// Arrays of the surface's tables. Reuses the arrays of a living surface with the same tables, which has the same
    /// `identity` within this process. Otherwise copies the tables, padded with zeros to whole packets.
    static std::shared_ptr<const Arrays> shared_arrays(const Surface &surface) {
        static std::mutex mutex;
        static std::map<uint64_t, std::weak_ptr<const Arrays>> by_identity;
        const std::lock_guard lock(mutex);
        // Removes the entries of tables that no surface uses any more.
        for (auto i = by_identity.begin(); i != by_identity.end();)
            i = i->second.expired() ? by_identity.erase(i) : std::next(i);
        auto &entry = by_identity[surface.identity()];
        if (auto arrays = entry.lock())
            return arrays;
        auto arrays = std::make_shared<Arrays>();
        for (size_t i = 0; i < COUNT; ++i)
            if (const auto words = surface.words(i); !words.empty()) {
                const size_t packets = (words.size() + PACKET_WORDS - 1) / PACKET_WORDS;
                std::vector<uint32_t> padded(packets * PACKET_WORDS);
                std::copy(words.begin(), words.end(), padded.begin());
                (*arrays)[i] = dr::load<UInt32X>(padded.data(), padded.size());
            }
        entry = arrays;
        return arrays;
    }

    std::shared_ptr<const Arrays> m_arrays;
};

} // namespace sunbeam
