// Smallest and largest value of a texture of one channel.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>

#include <mitsuba/render/interaction.h>
#include <mitsuba/render/texture.h>

namespace sunbeam {

namespace dr = drjit;

/// Smallest and largest value of a texture, from its values at the centres of its pixels. `otherwise` for textures that
/// need a place on a shape, such as attributes of meshes.
template <typename Float, typename Spectrum>
std::array<float, 2> texture_range(const mitsuba::Texture<Float, Spectrum> &texture, std::array<float, 2> otherwise) {
    const std::string_view kind = texture.class_name();
    // The class behind the plugin has a longer name.
    const bool is_bitmap = kind.substr(0, 13) == "BitmapTexture";
    if (!is_bitmap && kind != "UniformSpectrum")
        return otherwise;
    // A uniform texture has one value.
    uint32_t width = 1, height = 1;
    if (is_bitmap) {
        const auto size = texture.resolution();
        width           = uint32_t(size.x());
        height          = uint32_t(size.y());
    }
    auto value_at = [&](const auto &pixel) {
        auto si      = dr::zeros<mitsuba::SurfaceInteraction<Float, Spectrum>>();
        const auto y = pixel / width, x = pixel - y * width;
        si.uv = mitsuba::Point<Float, 2>((Float(x) + .5f) / float(width), (Float(y) + .5f) / float(height));
        return dr::detach(texture.eval_1(si));
    };
    const uint32_t count = width * height;
    if constexpr (dr::is_jit_v<Float>) {
        const Float values = value_at(dr::arange<dr::uint32_array_t<Float>>(count)) + dr::zeros<Float>(count);
        return { (float) dr::slice(dr::min(values)), (float) dr::slice(dr::max(values)) };
    } else {
        std::array<float, 2> range{ float(value_at(0u)), float(value_at(0u)) };
        for (uint32_t pixel = 1; pixel < count; ++pixel) {
            const float value = float(value_at(pixel));
            range             = { std::min(range[0], value), std::max(range[1], value) };
        }
        return range;
    }
}

} // namespace sunbeam
