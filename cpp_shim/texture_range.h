// Smallest and largest value of a texture of one channel.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <typeinfo>

#include <mitsuba/core/object.h>
#include <mitsuba/core/transform.h>
#include <mitsuba/render/interaction.h>
#include <mitsuba/render/texture.h>

namespace sunbeam {

namespace dr = drjit;

/// Reads the parameter `to_uv` of a bitmap: the transform from a surface's texture coordinates to the bitmap's.
template <typename Transform> class UvTransform final : public mitsuba::TraversalCallback {
public:
    /// The transform; the identity if there is no such parameter.
    Transform transform;

protected:
    void put_value(std::string_view name, void *value, uint32_t, const std::type_info &type) override {
        if (name == "to_uv" && type == typeid(Transform))
            transform = *static_cast<const Transform *>(value);
    }
    void put_object(std::string_view, mitsuba::Object *, uint32_t) override {}
};

/// Smallest and largest value of a texture.
///
/// A bitmap has its extremes at the centres of its pixels, since interpolation does not exceed the pixels' values. A
/// uniform texture has one value. The result is `fallback` for all other textures, such as attributes of meshes, and
/// for a bitmap whose transform `to_uv` has no inverse.
template <typename Float, typename Spectrum>
std::array<float, 2> texture_range(mitsuba::Texture<Float, Spectrum> &texture, std::array<float, 2> fallback) {
    const std::string_view class_name = texture.class_name();
    // Common beginning of the names of the classes by which Mitsuba implements the plugin `bitmap`.
    constexpr std::string_view BITMAP = "BitmapTexture";
    const bool is_bitmap              = class_name.substr(0, BITMAP.size()) == BITMAP;
    if (!is_bitmap && class_name != "UniformSpectrum")
        return fallback;
    uint32_t width = 1, height = 1;
    if (is_bitmap) {
        const auto size = texture.resolution();
        width           = uint32_t(size.x());
        height          = uint32_t(size.y());
    }
    UvTransform<mitsuba::AffineTransform<mitsuba::Point<dr::scalar_t<Float>, 3>>> to_uv;
    texture.traverse(&to_uv);
    if (dr::det(to_uv.transform.matrix) == 0.f)
        return fallback;
    const auto from_bitmap = to_uv.transform.inverse();
    // Value at the centre of a pixel, given by its number in row order: an integer, or a Dr.Jit array of them.
    auto value_at = [&](const auto &pixel) {
        auto si      = dr::zeros<mitsuba::SurfaceInteraction<Float, Spectrum>>();
        const auto y = pixel / width, x = pixel - y * width;
        si.uv =
            from_bitmap * mitsuba::Point<Float, 2>((Float(x) + .5f) / float(width), (Float(y) + .5f) / float(height));
        return dr::detach(texture.eval_1(si));
    };
    const uint32_t count = width * height;
    if constexpr (dr::is_jit_v<Float>) {
        // The texture of one value gives a single element. The sum with zeros makes an array of `count` elements of it.
        const Float values = value_at(dr::arange<dr::uint32_array_t<Float>>(count)) + dr::zeros<Float>(count);
        return { (float) dr::slice(dr::min(values)), (float) dr::slice(dr::max(values)) };
    } else {
        const float first = float(value_at(0u));
        std::array<float, 2> range{ first, first };
        for (uint32_t pixel = 1; pixel < count; ++pixel) {
            const float value = float(value_at(pixel));
            range             = { std::min(range[0], value), std::max(range[1], value) };
        }
        return range;
    }
}

} // namespace sunbeam
