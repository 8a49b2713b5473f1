"""The lobe keeps its values inside other BSDFs and in rendered scenes."""

import time

import mitsuba as mi
import numpy as np
import pytest
from batches import eval_pdf, intensity, interactions, is_scalar, one_by_one, random_directions
from conftest import built, use_variant
from surfaces import QUICK

SKIN = {**QUICK, "eta": 1.56, "diffuse_reflectance": 0.3}
# Relative difference of equal arithmetic in another kernel.
RTOL = 1e-4
# Relative error with maps, whose frames are normalised differences of texels in half or single precision.
FRAME_RTOL = 2e-2
# Ripple of the colour table's splines beside a peak, relative to the largest luminance.
RIPPLE = 2e-3
# Three standard errors of the mean of 16 pixels with 64 samples, for weights with a relative deviation of 1.
NOISE = 0.1


@pytest.fixture
def skin(typical_variant):
    return built(typical_variant, **SKIN)


def pixels(values):
    """A raw texture of the values."""
    return {"type": "bitmap", "bitmap": mi.Bitmap(np.array(values, dtype=np.float32)), "raw": True}


def pairs(count=200):
    rng = np.random.default_rng(41)
    wi, wo = random_directions(rng, count), random_directions(rng, count)
    return wi, wo, np.broadcast_to(np.float32([450, 520, 590, 660]), (count, 4))


def on_a_plane(bsdf, wi, wo, nm):
    """Values on a plane with the derivatives of positions that bump and normal maps need."""

    def complete(si):
        si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
        si.n, si.dp_du, si.dp_dv, si.uv = [0, 0, 1], [1, 0, 0], [0, 1, 0], [0.3, 0.6]
        return si

    ctx = mi.BSDFContext()
    if is_scalar():
        values = [bsdf.eval(ctx, complete(si), mi.Vector3f(o)) for si, o in zip(one_by_one(wi, nm), wo.tolist())]
        return np.array([intensity(value) for value in values])
    wo = mi.Vector3f(np.ascontiguousarray(wo.T))
    return intensity(bsdf.eval(ctx, complete(interactions(wi, nm)), wo)).T


def test_twosided_shows_the_same_on_both_sides(skin):
    wi, wo, nm = pairs()
    both = mi.load_dict({"type": "twosided", "nested": skin})
    front = eval_pdf(skin, wi, wo, nm)
    flip = np.float32([1, 1, -1])
    for found in (eval_pdf(both, wi, wo, nm), eval_pdf(both, wi * flip, wo * flip, nm)):
        np.testing.assert_allclose(found[0], front[0], rtol=RTOL)
        np.testing.assert_allclose(found[1], front[1], rtol=RTOL)
    assert np.any(front[0] > 0)


@pytest.mark.parametrize("weight", [0.0, 0.25, 1.0])
def test_blendbsdf_mixes(skin, weight):
    wi, wo, nm = pairs()
    other = mi.load_dict({"type": "diffuse", "reflectance": 0.8})
    mixed = eval_pdf(mi.load_dict({"type": "blendbsdf", "weight": weight, "a": skin, "b": other}), wi, wo, nm)
    for ours, a, b in zip(mixed, eval_pdf(skin, wi, wo, nm), eval_pdf(other, wi, wo, nm)):
        np.testing.assert_allclose(ours, (1 - weight) * a + weight * b, rtol=RTOL, atol=1e-6)


def test_mask_lets_its_share_through(skin):
    wi, wo, nm = pairs()
    masked = eval_pdf(mi.load_dict({"type": "mask", "opacity": 0.25, "nested": skin}), wi, wo, nm)
    np.testing.assert_allclose(masked[0], 0.25 * eval_pdf(skin, wi, wo, nm)[0], rtol=RTOL)


MAPS = {
    "normalmap": lambda level: ("normalmap", pixels([[level] * 4] * 4)),
    "bumpmap": lambda level: ("map", pixels([[[level * x] for x in range(4)]] * 4)),
}


def mapped(kind, skin, level):
    name, texture = MAPS[kind](level)
    return mi.load_dict({"type": kind, name: texture, "nested": skin})


@pytest.mark.parametrize(
    ("kind", "flat", "tilted"), [("normalmap", [0.5, 0.5, 1], [0.6, 0.5, 1]), ("bumpmap", 0, 0.03)]
)
def test_maps_turn_the_frame(skin, kind, flat, tilted):
    wi, wo, nm = pairs()
    bare = on_a_plane(skin, wi, wo, nm)
    unchanged = on_a_plane(mapped(kind, skin, flat), wi, wo, nm)
    np.testing.assert_allclose(unchanged, bare, rtol=FRAME_RTOL, atol=FRAME_RTOL * bare.max())
    turned = on_a_plane(mapped(kind, skin, tilted), wi, wo, nm)
    assert np.all(np.isfinite(turned))
    # Colours outside sRGB have negative channels; the luminance is negative by the splines' ripple at most.
    light = turned if mi.is_spectral else turned @ [0.2126729, 0.7151522, 0.072175]
    assert light.min() >= (0 if mi.is_spectral else -RIPPLE * light.max())
    assert np.median(np.abs(turned - bare) / np.maximum(bare, 1e-3)) > FRAME_RTOL


def sphere_scene(bsdf):
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 4},
            "sensor": {
                "type": "perspective",
                "fov": 20,
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8, "pixel_format": "luminance"},
            },
            "light": {"type": "constant"},
            "shape": {"type": "sphere", "bsdf": bsdf},
        }
    )


def rendered(bsdf, spp=64):
    image = np.array(mi.render(sphere_scene(bsdf), spp=spp))
    assert np.all(np.isfinite(image))
    assert np.all(image >= 0)
    return image[2:6, 2:6].mean()


def test_renders_inside_wrappers(skin):
    sky, alone = rendered({"type": "null"}), rendered(skin)
    white = {"type": "diffuse", "reflectance": 1.0}
    assert 0 < alone < 0.9 * sky
    expected = {
        "twosided": ({"type": "twosided", "nested": skin}, alone),
        "blendbsdf": ({"type": "blendbsdf", "weight": 0.5, "a": skin, "b": white}, (alone + sky) / 2),
        # Light through the mask meets the sphere's inside, which is black, or passes there as well.
        "mask": ({"type": "mask", "opacity": 0.5, "nested": skin}, alone / 2 + sky / 4),
        "normalmap": (mapped("normalmap", skin, [0.5, 0.5, 1]), alone),
        "bumpmap": (mapped("bumpmap", skin, 0), alone),
    }
    for name, (bsdf, brightness) in expected.items():
        assert abs(rendered(bsdf) - brightness) <= NOISE * sky, name


@pytest.mark.parametrize(
    "variant",
    ["llvm_ad_rgb", "llvm_ad_mono", "llvm_ad_spectral", "llvm_ad_mono_polarized", "llvm_ad_spectral_polarized"],
)
def test_the_first_render_completes(variant, capsys):
    """Prints the time, which includes compiling a kernel; a time limit would fail on busy machines."""
    use_variant(variant)
    start = time.perf_counter()
    # Energy is conserved in variants whose tables other tests share.
    scaled = variant in ("llvm_ad_spectral", "llvm_ad_mono")
    options = {} if scaled else {"conserve_energy": False, "tolerance": 1e-2}
    bsdf = built(variant, preset="xenopeltis", **options)
    built_at = time.perf_counter()
    rendered(bsdf, spp=8)
    first_at = time.perf_counter()
    rendered(bsdf, spp=8)
    with capsys.disabled():
        print(
            f"\nxenopeltis in {variant}: built or found in {built_at - start:.1f} s, first render "
            f"{first_at - built_at:.1f} s, second {time.perf_counter() - first_at:.1f} s"
        )
