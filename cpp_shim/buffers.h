// A surface's tables in a backend's memory.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include <drjit/traversable_base.h>
#include <mitsuba/render/bsdf.h>

#include "sunbeam_mitsuba/src/bridge.rs.h"

namespace sunbeam {

namespace dr = drjit;

/// Arrays of `u32` that kernels gather from. Surfaces with the same tables share one copy in all variants of a backend.
template <typename Float> class Buffers {
public:
    static constexpr size_t COUNT = 3;
    using UInt32X                 = mitsuba::DynamicBuffer<dr::uint32_array_t<Float>>;
    using Words                   = std::array<UInt32X, COUNT>;

    explicit Buffers(const Surface &surface) : m_words(shared(surface)) {}

    /// Dr.Jit indices of the arrays; 0 for an empty table.
    std::array<uint32_t, COUNT> indices() const {
        std::array<uint32_t, COUNT> indices;
        for (size_t i = 0; i < COUNT; ++i)
            indices[i] = (*m_words)[i].index();
        return indices;
    }

    /// Shows the variables to frozen functions, whose inputs they are.
    void traverse_1_cb_ro(void *payload, dr::detail::traverse_callback_ro fn) const {
        for (const UInt32X &words : *m_words)
            fn(payload, words.index_combined(), "", "");
    }
    /// Ignores what comes back: tables are never written, and other threads may be reading these.
    void traverse_1_cb_rw(void *payload, dr::detail::traverse_callback_rw fn) const {
        for (const UInt32X &words : *m_words)
            fn(payload, words.index_combined(), "", "");
    }

private:
    /// The copy in use, or a new one.
    static std::shared_ptr<const Words> shared(const Surface &surface) {
        static std::mutex mutex;
        static std::map<uint64_t, std::weak_ptr<const Words>> in_use;
        const std::lock_guard lock(mutex);
        for (auto i = in_use.begin(); i != in_use.end();)
            i = i->second.expired() ? in_use.erase(i) : std::next(i);
        auto &entry = in_use[surface.identity()];
        if (auto words = entry.lock())
            return words;
        auto words = std::make_shared<Words>();
        for (size_t i = 0; i < COUNT; ++i)
            if (const auto from = surface.words(i); !from.empty()) {
                // Packet gathers need arrays whose length is a multiple of the packet's four words.
                std::vector<uint32_t> whole_packets((from.size() + 3) / 4 * 4);
                std::copy(from.begin(), from.end(), whole_packets.begin());
                (*words)[i] = dr::load<UInt32X>(whole_packets.data(), whole_packets.size());
            }
        entry = words;
        return words;
    }

    std::shared_ptr<const Words> m_words;
};

} // namespace sunbeam
