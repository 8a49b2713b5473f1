// The words of a surface's tables in a backend's memory.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <mutex>

#include <drjit/traversable_base.h>
#include <mitsuba/render/bsdf.h>

#include "sunbeam/src/mitsuba/bridge.rs.h"

namespace sunbeam {

namespace dr = drjit;

/// Variables that kernels gather from. Surfaces that share their tables share the memory, in all variants of a backend.
template <typename Float> class Buffers {
public:
    using UInt32X = mitsuba::DynamicBuffer<dr::uint32_array_t<Float>>;
    using Words   = std::array<UInt32X, 3>;

    explicit Buffers(const Surface &surface) : m_shared(shared(surface)) {
        m_table   = (*m_shared)[0];
        m_sampler = (*m_shared)[1];
        m_albedo  = (*m_shared)[2];
    }

    /// The indices of the variables.
    std::array<uint32_t, 3> indices() const {
        return { dr::detach(m_table).index(), dr::detach(m_sampler).index(), dr::detach(m_albedo).index() };
    }

private:
    /// Uploads what is not in use yet.
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
        for (size_t i = 0; i < words->size(); ++i)
            if (const auto from = surface.words(i); !from.empty())
                (*words)[i] = dr::load<UInt32X>(from.data(), from.size());
        entry = words;
        return words;
    }

    /// Keeps the memory shared while the members below are this object's own handles, as `DRJIT_TRAVERSE` needs them.
    std::shared_ptr<const Words> m_shared;
    UInt32X m_table, m_sampler, m_albedo;

public:
    DRJIT_TRAVERSE(Buffers, m_table, m_sampler, m_albedo)
};

} // namespace sunbeam
