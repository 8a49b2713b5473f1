"""Kernels that Rust traces into Dr.Jit: several BSDFs, frozen, cached, masked, failing, in all modes of loops."""

import gc
import re

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from batches import random_directions, random_wavelengths
from conftest import built

COUNT = 300
SURFACES = [
    {"preset": "blazed"},
    {"preset": "sinusoidal", "conserve_energy": False},
    {"preset": "cd"},
    {"preset": "lamellar", "model": "patch"},
]
# Largest difference between kernels that fuse differently, relative to the largest value.
SINGLE = 1e-5


def question(count=COUNT, seed=17):
    """A surface interaction with random direction and wavelengths, an outgoing direction, and random numbers."""
    rng = np.random.default_rng(seed)
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(random_directions(rng, count).T)
    if mi.is_spectral:
        si.wavelengths = type(si.wavelengths)(random_wavelengths(rng, count).T)
    wo = mi.Vector3f(random_directions(rng, count).T)
    numbers = mi.Vector3f(rng.random((3, count)).astype(np.float32))
    dr.eval(si, wo, numbers)
    return si, wo, numbers


def answers(bsdf, si, wo, numbers, active=True):
    """All answers of a BSDF: value, density, both, and a sample's direction and weight."""
    ctx = mi.BSDFContext()
    sample, weight = bsdf.sample(ctx, si, numbers.x, mi.Point2f(numbers.y, numbers.z), active)
    return (
        bsdf.eval(ctx, si, wo, active),
        bsdf.pdf(ctx, si, wo, active),
        *bsdf.eval_pdf(ctx, si, wo, active),
        sample.wo,
        weight,
    )


def as_numbers(given):
    dr.eval(given)
    return [np.array(one) for one in given]


def assert_same(ours, theirs):
    for a, b in zip(ours, theirs):
        np.testing.assert_allclose(a, b, rtol=0, atol=SINGLE * np.abs(b).max())


@pytest.fixture
def flags():
    """Sets flags of Dr.Jit for one test."""
    changed = []

    def change(flag, value):
        changed.append((flag, dr.flag(flag)))
        dr.set_flag(flag, value)

    yield change
    for flag, value in reversed(changed):
        dr.set_flag(flag, value)


@pytest.mark.parametrize("symbolic", [True, False])
def test_many_surfaces_answer_in_one_kernel(traced, flags, symbolic):
    bsdfs = [built(traced, **parameters) for parameters in SURFACES]
    si, wo, numbers = question()
    which = dr.arange(mi.UInt32, COUNT) % len(bsdfs)
    alone = [as_numbers(answers(bsdf, si, wo, numbers)) for bsdf in bsdfs]
    pointers = mi.BSDFPtr(bsdfs[0])
    for i, bsdf in enumerate(bsdfs):
        pointers = dr.select(which == i, mi.BSDFPtr(bsdf), pointers)
    flags(dr.JitFlag.SymbolicCalls, symbolic)
    together = as_numbers(answers(pointers, si, wo, numbers))
    for i, wanted in enumerate(alone):
        mine = np.arange(COUNT) % len(bsdfs) == i
        assert_same([one[..., mine] for one in together], [one[..., mine] for one in wanted])


# Flags that this release of Dr.Jit has.
MODES = [
    name for name in ("SymbolicLoops", "OptimizeLoops", "LoopInvariantCodeMotion", "Debug") if hasattr(dr.JitFlag, name)
]


@pytest.mark.parametrize("flag", MODES)
def test_tracing_modes_agree(traced, flags, flag):
    flag = getattr(dr.JitFlag, flag)
    bsdf = built(traced, **SURFACES[0])
    usual = as_numbers(answers(bsdf, *question()))
    flags(flag, not dr.flag(flag))
    assert_same(as_numbers(answers(bsdf, *question())), usual)


def test_masked_lanes_do_not_matter(traced):
    bsdf = built(traced, **SURFACES[0])
    si, wo, numbers = question()
    usual = as_numbers(answers(bsdf, si, wo, numbers))
    active = dr.arange(mi.UInt32, COUNT) % 3 != 0
    si.wi = dr.select(active, si.wi, dr.nan)
    wo = dr.select(active, wo, dr.nan)
    value, pdf, both, both_pdf, _, weight = as_numbers(answers(bsdf, si, wo, numbers, active))
    kept = np.arange(COUNT) % 3 != 0
    for ours, theirs in [
        (value, usual[0]),
        (pdf, usual[1]),
        (both, usual[2]),
        (both_pdf, usual[3]),
        (weight, usual[5]),
    ]:
        assert_same([ours[..., kept]], [theirs[..., kept]])
        assert np.all(ours[..., ~kept] == 0)


def test_the_second_render_compiles_nothing(traced):
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 16, "height": 16},
            },
            "light": {"type": "constant"},
            "left": {"type": "sphere", "center": [-1, 0, 0], "bsdf": {"type": "diffraction", **SURFACES[0]}},
            "right": {"type": "sphere", "center": [1, 0, 0], "bsdf": {"type": "diffraction", **SURFACES[1]}},
        }
    )
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        pictures = []
        for seed in range(3):
            dr.kernel_history_clear()
            pictures.append(np.array(mi.render(scene, spp=4, seed=seed)))
            kernels = dr.kernel_history([dr.KernelType.JIT])
            assert kernels
            assert seed == 0 or all(kernel["cache_hit"] for kernel in kernels)
    assert np.all(np.isfinite(pictures))
    assert pictures[0].mean() > 0.1
    assert not np.array_equal(pictures[0], pictures[1])


def test_frozen_functions_replay(traced):
    bsdf = built(traced, **SURFACES[2])

    @dr.freeze
    def frozen(bsdf, si, wo, numbers):
        return answers(bsdf, si, wo, numbers)

    for seed in range(5):
        si, wo, numbers = question(seed=seed)
        given = frozen(bsdf, si, wo, numbers)
        assert_same(as_numbers(given), as_numbers(answers(bsdf, si, wo, numbers)))
    # Dr.Jit may record a second time, with inputs that were not constant.
    assert frozen.n_recordings <= 2


def variables():
    """Numbers of Dr.Jit's variables and of references to them."""
    gc.collect()
    dr.sync_thread()
    return dr.whos(as_string=True)


def test_references_are_balanced(traced):
    bsdf = built(traced, **SURFACES[0])
    si, wo, numbers = question()

    def ask():
        as_numbers(answers(bsdf, si, wo, numbers))

    def fail():
        # Arrays of three sizes do not match.
        wrong = question(COUNT + 1)[0]
        wrong.wi = si.wi
        with pytest.raises(RuntimeError, match="size"):
            as_numbers(answers(bsdf, wrong if mi.is_spectral else si, question(COUNT + 2)[1], numbers))

    def rows(call):
        call()
        before = variables()
        for _ in range(3):
            call()
        return before.count("\n"), variables().count("\n")

    for call in [ask, fail, ask]:
        before, after = rows(call)
        assert before == after


def test_refusals_of_dr_jit_are_exceptions(traced):
    if not mi.is_spectral:
        pytest.skip("without wavelengths Mitsuba meets the mismatch first")
    bsdf = built(traced, **SURFACES[0])
    si, wo, numbers = question()
    wanted = as_numbers(answers(bsdf, si, wo, numbers))
    wrong, longer = question()[0], question(COUNT + 1)[0]
    wrong.wavelengths = longer.wavelengths
    for call in [
        lambda: bsdf.eval(mi.BSDFContext(), wrong, wo),
        lambda: bsdf.pdf(mi.BSDFContext(), wrong, wo),
        lambda: bsdf.eval_pdf(mi.BSDFContext(), wrong, wo),
    ]:
        with pytest.raises(RuntimeError, match=r"Dr\.Jit could not trace the surface: .*size"):
            call()
    assert_same(as_numbers(answers(bsdf, si, wo, numbers)), wanted)


def arrays_of_words():
    """References to each array of integers in Dr.Jit's memory of the size of tables."""
    rows = re.findall(r"^\s+\d+\s+LLVM\s+u32\s+LLVM\D+(\d+)\s+(\d+)\s", variables(), re.MULTILINE)
    return [int(references) for references, size in rows if int(size) > 100]


def test_equal_surfaces_share_their_tables(traced):
    parameters = {"type": "diffraction", "preset": "sinusoidal", "coherence_length": 33.0}
    first = mi.load_dict(parameters)
    alone = arrays_of_words()
    assert alone
    wanted = as_numbers(answers(first, *question()))
    others = [mi.load_dict({**parameters, "rotation": float(i)}) for i in range(4)]
    assert len(arrays_of_words()) == len(alone)
    other_tables = mi.load_dict({**parameters, "coherence_length": 34.0})
    assert len(arrays_of_words()) > len(alone)
    # The remaining surface keeps the tables.
    del first, other_tables, others[1:]
    assert arrays_of_words() == alone
    assert_same(as_numbers(answers(others[0], *question())), wanted)
    del others
    assert len(arrays_of_words()) < len(alone)
