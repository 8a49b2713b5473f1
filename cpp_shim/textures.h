// Textures of one BSDF instance: refractive index, reflectances, rotation, and relative sizes of the relief.
#pragma once

#include <array>
#include <ostream>
#include <string>
#include <tuple>

#include <mitsuba/core/properties.h>
#include <mitsuba/core/string.h>
#include <mitsuba/render/ior.h>
#include <mitsuba/render/texture.h>

#include "lobe.h"
#include "parameters.h"
#include "spectral_ends.h"
#include "sunbeam_mitsuba/src/bridge.rs.h"
#include "texture_range.h"

namespace sunbeam {

using namespace mitsuba;

/// The textures of an instance. `read` sets them. Afterwards their values change only through Mitsuba, by the
/// parameters of `traverse`.
template <typename Float, typename Spectrum> struct Textures {
    MI_IMPORT_TYPES(Texture)

    /// Refractive index eta + ik of the material, relative to air; 0 + i for a perfect reflector.
    ref<Texture> eta, k;
    /// Constant extrapolation of `eta` and `k` beyond the wavelengths of their spectra.
    SpectralEnds<Float, Spectrum> eta_ends, k_ends;
    /// Factor on the reflectance of the surface.
    ref<Texture> specular_reflectance;
    /// Factor on the transmittance of a body that transmits; null for surfaces that only reflect.
    ref<Texture> specular_transmittance;
    /// Reflectance of the pigment; null without one.
    ref<Texture> diffuse_reflectance;
    /// Rotation of the relief about the normal in degrees, counter-clockwise from the tangent.
    ref<Texture> rotation;
    /// Size of the pattern (`scale`) and of the heights (`depth`) relative to the relief; null for a number.
    ref<Texture> scale, depth;

    /// Reads the textures from the plugin's properties and returns the ranges of the relative sizes.
    ///
    /// `transmits` tells whether the surface is a body that transmits. `material` comes from `material_name`, "none"
    /// without one. `index` has the spectra of eta and k, which are continued beyond their ends.
    TextureSizes read(const Properties &props, bool transmits, const std::string &material,
                      const IndexSpectrum &index) {
        if (material != "none") {
            std::tie(eta, k) = complex_ior_from_file<Spectrum, Texture>(material);
        } else {
            // Without a material or `eta`, the index 0 + i reflects everything. `eta` without `k` is a dielectric.
            const bool dielectric = props.has_property("eta");
            eta                   = props.get_unbounded_texture<Texture>("eta", 0.f);
            k                     = props.get_unbounded_texture<Texture>("k", dielectric ? 0.f : 1.f);
        }
        // The text for `part`, "eta" or "k", in messages.
        const auto source = [&](const std::string &part) {
            return material == "none" ? "parameter \"" + part + "\"" : part + " of material \"" + material + "\"";
        };
        eta_ends.initialise(eta, source("eta"), index.eta_nm, index.eta);
        k_ends.initialise(k, source("k"), index.k_nm, index.k);
        specular_reflectance = props.get_texture<Texture>("specular_reflectance", 1.f);
        rotation             = props.get_unbounded_texture<Texture>("rotation", 0.f);
        if (transmits)
            specular_transmittance = props.get_texture<Texture>("specular_transmittance", 1.f);
        if (props.has_property("diffuse_reflectance"))
            diffuse_reflectance = props.get_texture<Texture>("diffuse_reflectance", 0.f);
        // A size without a texture keeps the range [1, 1]: the relief is built at that size.
        TextureSizes sizes{ false, { 1.f, 1.f }, { 1.f, 1.f } };
        auto read_size = [&](const char *name, ref<Texture> &texture, std::array<float, 2> &range) {
            if (!props.has_property(name) || is_number(props, name))
                return;
            texture     = props.get_unbounded_texture<Texture>(name);
            range       = texture_range(*texture, UNKNOWN_SIZES);
            sizes.given = true;
        };
        read_size("scale", scale, sizes.scale);
        read_size("depth", depth, sizes.depth);
        return sizes;
    }

    /// Scale and depth at a point. 1 for a parameter that is a number: the relief has that size already.
    typename DiffractionLobe<Float, Spectrum>::Size size(const SurfaceInteraction3f &si, const Mask &active) const {
        return { scale ? scale->eval_1(si, active) : Float(1.f), depth ? depth->eval_1(si, active) : Float(1.f) };
    }

    /// Whether the diffracted light varies with the place on the surface.
    bool diffraction_varies() const {
        return varies(eta) || varies(k) || varies(specular_reflectance) || varies(specular_transmittance) ||
               varies(rotation) || varies(scale) || varies(depth);
    }
    /// Whether the pigment's light, which passes the interface, varies with the place on the surface.
    bool pigment_varies() const {
        return varies(diffuse_reflectance) || varies(eta) || varies(k) || varies(specular_reflectance);
    }

    /// Exposes the textures to Mitsuba as parameters that can change. The flags of `eta` and `k` are those of
    /// `roughconductor`.
    void traverse(TraversalCallback *cb) const {
        // Copies, since a constant reference would select the overload of `put` for values instead of objects.
        auto put = [&](const char *name, ref<Texture> texture, auto flags) { cb->put(name, texture, flags); };
        if (specular_transmittance) {
            // A body that transmits. Its `eta` and `k` are not exposed, since its tables are built for them.
            put("specular_transmittance", specular_transmittance, ParamFlags::Differentiable);
        } else {
            put("eta", eta, ParamFlags::Differentiable | ParamFlags::Discontinuous);
            put("k", k, ParamFlags::Differentiable | ParamFlags::Discontinuous);
        }
        put("specular_reflectance", specular_reflectance, ParamFlags::Differentiable);
        if (diffuse_reflectance)
            put("diffuse_reflectance", diffuse_reflectance, ParamFlags::Differentiable);
        put("rotation", rotation, ParamFlags::Differentiable | ParamFlags::Discontinuous);
        if (scale)
            put("scale", scale, ParamFlags::Differentiable | ParamFlags::Discontinuous);
        if (depth)
            put("depth", depth, ParamFlags::Differentiable | ParamFlags::Discontinuous);
    }

    /// Calls `visit` with each member, as all of them hold variables of Dr.Jit. Textures may be null.
    template <typename Visit> void each_traversable(const Visit &visit) const {
        visit(eta);
        visit(k);
        visit(&eta_ends);
        visit(&k_ends);
        visit(specular_reflectance);
        visit(specular_transmittance);
        visit(diffuse_reflectance);
        visit(rotation);
        visit(scale);
        visit(depth);
    }

    /// Writes `name = texture` for each texture that `traverse` exposes, as part of an object's description.
    void print(std::ostream &out) const {
        if (specular_transmittance)
            out << "  specular_transmittance = " << string::indent(specular_transmittance) << "," << std::endl;
        else
            out << "  eta = " << string::indent(eta) << "," << std::endl
                << "  k = " << string::indent(k) << "," << std::endl;
        out << "  specular_reflectance = " << string::indent(specular_reflectance) << "," << std::endl;
        if (diffuse_reflectance)
            out << "  diffuse_reflectance = " << string::indent(diffuse_reflectance) << "," << std::endl;
        if (scale)
            out << "  scale = " << string::indent(scale) << "," << std::endl;
        if (depth)
            out << "  depth = " << string::indent(depth) << "," << std::endl;
        out << "  rotation = " << string::indent(rotation) << std::endl;
    }

private:
    /// Assumed range of sizes in textures whose values are known only on a shape, such as mesh attributes
    /// (docs/model.md#covers-and-relative-sizes). A wider range would make the table that limits the energy larger.
    /// The energy at sizes outside is limited as at the end of the range.
    static constexpr std::array<float, 2> UNKNOWN_SIZES = { .25f, 1.f };

    static bool varies(const ref<Texture> &texture) { return texture && texture->is_spatially_varying(); }
};

} // namespace sunbeam
