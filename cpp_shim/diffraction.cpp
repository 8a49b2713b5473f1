/**
 * Diffraction by a measured or synthetic nanostructure (`diffraction`)
 * ====================================================================
 *
 * Iridescent reflection by a surface whose relief is as fine as the wavelength: snake skin, ruled gratings, discs; and
 * transmission by films and glass. A reflecting surface is one-sided; wrap it in `twosided` where the back may be seen.
 * A body that transmits has two sides, and `twosided` refuses it. Works inside `blendbsdf`, `mask`, `normalmap` and
 * `bumpmap`, and needs a UV parameterisation: x of the relief follows the tangent dp/du.
 *
 * parameter             type             meaning (default)
 * --------------------  ---------------  ------------------------------------------------------------------------
 * preset                string           blazed, sinusoidal, lamellar, cd, elaphe, xenopeltis, flat
 *                                        (elaphe, where there is no filename either)
 * period, height        float, um        period along x of blazed, sinusoidal and lamellar, and their height from
 *                                        valley to peak; blazed rises along +x; in (0, 1e3] (2.5 and 0.25; lamellar is
 *                                        0.125 high)
 * region_size           float, um        edge of the square sub-regions of elaphe and xenopeltis, in [3, 33] (none)
 * region_spread         float            fraction by which the period is shorter or longer in alternate sub-regions, in
 *                                        [0, 0.1]; required with region_size (none)
 * filename              string           height field (.gwy, .gsf, .spm, .sdf, .x3p, .tif, .exr, .png, .npy, .xyz,
 *                                        .txt, .csv, .asc, .dat, .grd; see docs/height-fields.md), found as Mitsuba
 *                                        finds files
 * pixel_size            float, um        edge of a pixel, if the file has no scale; in (0, 1e3]
 * max_height            float, um        height of the largest value, if the file has no unit of height; in (0, 1e3]
 * channel               string           channel of a file with several, by number or title (first that is a height)
 * fill                  string           none, laplace, mean: heights for the file's holes (none: a file with holes
 *                                        is refused)
 * level                 string           none, mean, plane, quadratic, lines: form subtracted from the heights (plane
 *                                        for files, none for presets)
 * tiling                string           periodic, aperiodic (aperiodic for files by scalar theory, else periodic)
 * scale, depth          float or         size of the pattern, and of its heights, relative to the relief given; in
 *                       texture          [1e-3, 1] (1). Exposed; a change of a number builds the tables anew, and
 *                                        textures are differentiable. Textures need scalar theory
 * theory                string           scalar, or rigorous: Maxwell's equations, for reliefs that vary only along x
 *                                        (scalar)
 * coherence_length      float, um        4 standard deviations of the coherence window, in [1e-3, 1e5] (65). Exposed;
 *                                        a change builds the tables anew
 * model                 string           ensemble: mean over all positions of the coherence window; patch: one position
 *                                        (ensemble)
 * obliquity             string           auto, stam, small_slope, unit (auto: small_slope if k is at most a tenth of
 *                                        eta at every wavelength, else stam); small_slope needs eta and k as numbers
 *                                        or spectra
 * conserve_energy       boolean          divides the reflectance so that the albedo is at most 1 (true for ensemble,
 *                                        false for patch)
 * shadowing             boolean          V-cavity shadowing and masking (false)
 * tolerance             float            relative error that tables are built to, in [1e-6, 0.1] (1e-3)
 * build_limit           float            factor on the limits of a build, 8 GB and two minutes on two cores, in
 *                                        [1, 1e6] (1)
 * material              string           a measured metal of Mitsuba ("Al", "Au", ...), or none: a perfect reflector
 *                                        (none)
 * eta, k                spectrum or      complex index of refraction instead of a material; eta alone is a dielectric
 *                       texture          such as keratin (1.56). Beyond its ends a spectrum keeps its end values.
 *                                        Exposed, differentiable
 * cover_eta             float, string    index of a flat clear layer over the relief, in [1, 2.6], or the name of its
 *                       or spectrum      medium as for int_ior; of a spectrum the value at 589 nm (no layer)
 * cover_reflection      boolean          mirror reflection by that layer's flat side, a delta lobe (true)
 * transmission          string           none; film: a sheet with the relief above, a flat side below, and air on both
 *                                        sides; interface: light goes on in the medium (none)
 * int_ior, ext_ior      float or string  media below and above a body that transmits, in place of eta, which is one
 *                                        number then: 1, or in [1.2, 4] (bk7, air)
 * back_reflection       boolean          mirror reflection by a film's flat side from behind, a delta lobe (true)
 * specular_transmittance                 factor on the transmitted light (1). Exposed, differentiable
 *                       spectrum or
 *                       texture
 * specular_reflectance  spectrum or      scales the diffracted light (1). Exposed, differentiable
 *                       texture
 * diffuse_reflectance   spectrum or      pigment under the surface, lit by the light that the surface does not reflect;
 *                       texture          black under a perfect reflector (0). Exposed where given, differentiable
 * rotation              float or         turns the relief counter-clockwise against the tangent, in degrees (0).
 *                       texture          Exposed, differentiable
 *
 * An unknown parameter, a contradiction, or a value out of range raises an error that names the parameter.
 *
 * Model
 * -----
 * wi and wo are unit vectors that point away from the surface, in the frame of the relief h(x, y). theta_i and theta_o
 * are their angles with the normal, and lambda is the wavelength. With u = wi.x + wo.x, v = wi.y + wo.y and
 * w = cos(theta_i) + cos(theta_o), the scalar theory reflects
 *
 *     f_r(wi, wo, lambda) = R O M S(f; kappa) / lambda^2,     f = (u, v) / lambda,     kappa = 2 pi w / lambda
 *
 * Lengths are in um. S is the power spectrum of the phase screen exp(i kappa h) under a Gaussian coherence window, R
 * the Fresnel reflectance at the half vector, and O the obliquity factor: (1 + dot(wi, wo))^2 / (cos(theta_i)
 * cos(theta_o) w^2) for stam, 1 for unit. M is the V-cavity factor, 1 without shadowing. With small_slope, the factor Q
 * of first-order small-slope theory replaces R O (docs/model.md). The pigment adds
 *
 *     (1 - specular R(theta_i)) (1 - specular R(theta_o)) diffuse / pi,
 *
 * where specular and diffuse are the two reflectance parameters. docs/model.md has transmission and the rigorous
 * theory.
 *
 * Components of a reflecting surface are the diffracted light (0), the pigment where given (1), and last the mirror
 * reflection of a cover. Those of a body that transmits are diffracted reflection (0), transmission (1), and a film's
 * mirror (2). In polarised variants the diffracted light has the Mueller matrix of Fresnel's amplitudes at the half
 * vector, or of the small-slope amplitudes. Each order of the rigorous theory has a matrix of its own. The pigment
 * depolarises.
 *
 *   J. Stam: Diffraction Shaders. SIGGRAPH 1999.
 *   D. S. Dhillon et al.: Interactive Diffraction from Biological Nanostructures. Comput. Graph. Forum 33(8), 2014.
 *   D. S. Dhillon, A. Ghosh: Efficient Surface Diffraction Renderings with Chebyshev Approximations. SIGGRAPH Asia
 *   Technical Briefs, 2016.
 *   A. G. Voronovich: Small-slope approximation in wave scattering by rough surfaces. Sov. Phys. JETP 62(1), 1985.
 *   A. Krywonos, J. E. Harvey, N. Choi: Linear systems formulation of scattering theory. JOSA A 28(6), 2011.
 *
 * Use
 * ---
 *     <bsdf type="twosided">
 *         <bsdf type="diffraction">
 *             <string name="preset" value="blazed"/>
 *             <float name="period" value="2.5"/>
 *             <string name="material" value="Al"/>
 *         </bsdf>
 *     </bsdf>
 *
 *     mi.set_variant("llvm_ad_spectral")
 *     mi.file_resolver().append("<repository>/target/mitsuba")
 *     skin = mi.load_dict({"type": "diffraction", "preset": "xenopeltis", "eta": 1.56, "diffuse_reflectance": 0.05})
 *
 * Files
 * -----
 *     diffraction.cpp    entry point
 *     diffraction.h      the BSDF class that Mitsuba calls
 *     optics.h           value, density and samples of one instance
 *     reflection.h       value, density and samples of a surface that only reflects
 *     transmission.h     value, density and samples of a body that transmits
 *     textures.h         textures of one instance
 *     lobe.h             the diffracted lobe, evaluated in Rust
 *     cover.h            a clear layer over the relief
 *     interface.h        Fresnel and small-slope factors, and their Mueller matrices
 *     rotation.h         rotation of the relief about the normal
 *     texture_range.h    smallest and largest value of a texture
 *     spectral_ends.h    eta and k beyond the ends of their spectra
 *     parameters.cpp     checks of Mitsuba's properties, and their conversion to the JSON that Rust reads
 *     buffers.h          tables in a backend's memory
 *     fingerprint.h      whether a frozen function still fits the surface
 *     checks.cpp         compatibility with the running Mitsuba
 *     compat.h           differences between releases of Mitsuba
 *     jit.cpp            Dr.Jit's operations for Rust's tracing
 *     jit_tests.cpp      helpers of the tests of tracing, not part of the plugin
 *     log.cpp            lines for Mitsuba's log
 *     variants_*.cpp     instantiations, one file per backend
 *     src/               the Rust side
 */

#include <stdexcept>
#include <string_view>

#include <mitsuba/core/object.h>

#include "variants.h"

namespace sunbeam {

// Described in variants.h. Null until `sunbeam_register_variants` sets it.
const void *mitsuba_address = nullptr;

namespace {

/// Number of variants in a list such as Mitsuba's MI_VARIANTS, in which every name ends with a newline.
constexpr size_t count_variants(std::string_view list) {
    size_t count = 0;
    for (char c : list)
        count += c == '\n';
    return count;
}

} // namespace
} // namespace sunbeam

/// Registers every variant of the plugin `name` by Mitsuba's function `fn`. Rust's `init_plugin`, whose name Mitsuba
/// looks up, calls this function and lets its exceptions pass.
extern "C" void sunbeam_register_variants(std::string_view name, mitsuba::PluginRegisterFn fn) {
    using namespace sunbeam;
    // `fn` lies in Mitsuba's core library.
    mitsuba_address = reinterpret_cast<const void *>(fn);
    const size_t count =
        register_scalar_variants(name, fn) + register_llvm_variants(name, fn) + register_cuda_variants(name, fn);
    if (count != count_variants(MI_VARIANTS))
        throw std::logic_error("the diffraction plugin lacks a variant of this Mitsuba");
}
