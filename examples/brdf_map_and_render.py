# %% [markdown]
# A BRDF map and a rendered picture of one material. Each `# %%` begins a cell of a notebook.
#
# The material is the skin of the snake Xenopeltis, of index 1.56. The coherence length in µm is shorter than the
# default of 65, that of filtered sunlight, so that orders are wide enough for a map of 128 pixels.

# %%
import matplotlib.pyplot as plt
import mitsuba as mi
import numpy as np
import sunbeam_mitsuba  # also makes the plugin "diffraction" available in Mitsuba

mi.set_variant("llvm_ad_spectral")
material = {"preset": "xenopeltis", "coherence_length": 30.0, "eta": 1.56}

# %% [markdown]
# The BSDF over the outgoing hemisphere, seen from above with x to the right and y up. Light comes in at 30
# degrees from the normal, from the side of +x. `wi` points to the light and `wo` to the viewer; both are unit vectors
# with z along the normal. A pixel at (x, y) inside the unit disc is the direction `wo` = (x, y, cosine), where the
# cosine is that of the angle to the normal.

# %%
size = 128
x, y = np.meshgrid((np.arange(size) + 0.5) / size * 2 - 1, 1 - (np.arange(size) + 0.5) / size * 2)
inside = x**2 + y**2 < 1
cosine = np.sqrt(1 - x[inside] ** 2 - y[inside] ** 2)
wo = np.stack([x[inside], y[inside], cosine], axis=-1)
wi = [np.sin(np.radians(30)), 0, np.cos(np.radians(30))]
wavelength_nm = np.arange(380, 781, 10)

surface = sunbeam_mitsuba.Surface(**material)
f = surface.eval(wi, wo, wavelength_nm)  # BSDF without the cosine, [directions, wavelengths], in 1/sr

# %% [markdown]
# Colours: the CIE 1931 observer under an equal-energy illuminant, in linear sRGB. XYZ is the sum over the wavelengths,
# divided by that of the observer's Y, so a BSDF of 1 (in 1/sr) has Y = 1. The exposure clips 1 % of the disc, and a
# power of 1/2.2 approximates the sRGB encoding.

# %%
observer = np.array(mi.cie1931_xyz(mi.Float(wavelength_nm))).T
xyz = f @ observer / observer[:, 1].sum()
rgb = np.array(mi.xyz_to_srgb(mi.Color3f(xyz.T))).T
brdf_map = np.zeros((size, size, 3))
brdf_map[inside] = np.clip(rgb / np.percentile(rgb.max(axis=-1), 99), 0, 1) ** (1 / 2.2)
plt.imsave("brdf_map.png", brdf_map)

# %% [markdown]
# A ball of that material under sun and sky. Pigment below the surface adds a little diffuse light.

# %%
scene = mi.load_dict(
    {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "sensor": {
            "type": "perspective",
            "fov": 30,
            "to_world": mi.ScalarTransform4f().look_at([0, -4, 2], [0, 0, 0], [0, 0, 1]),
            "film": {"type": "hdrfilm", "width": 128, "height": 128},
        },
        "sun": {"type": "directional", "direction": [0.3, 0.5, -1.0], "irradiance": 3.0},
        "sky": {"type": "constant", "radiance": 0.2},
        "ball": {"type": "sphere", "skin": {"type": "diffraction", "diffuse_reflectance": 0.03, **material}},
    }
)
picture = np.array(mi.util.convert_to_bitmap(mi.render(scene, spp=32)))

# %% [markdown]
# Map and picture beside each other.

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(8, 4))
left.imshow(brdf_map, extent=(-1, 1, -1, 1))
left.set(title="BRDF map", xlabel="wo.x", ylabel="wo.y")
right.imshow(picture)
right.set(title="render")
right.axis("off")
figure.savefig("brdf_map_and_render.png", dpi=120)
