"""What one call of a BSDF costs in nanoseconds: big wavefronts by the Python API, less what an empty kernel takes."""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.skin import preset_skin

from .benchmark_scenes import ALPHA, ALUMINIUM, REFERENCE

VARIANTS = ("llvm_ad_spectral", "llvm_ad_rgb")
RELIEFS = ("blazed", "xenopeltis")
CALLS = ("eval", "pdf", "eval_pdf", "sample")
# Elements of a wavefront: the first tells how many more fit into the time.
FEWEST, MOST = 1 << 10, 1 << 21
# Seconds that a kernel should take, and how often each has its turn.
KERNEL_S, TURNS = 0.1, 7
SEED = 1


def bsdfs() -> dict[str, dict]:
    """Two reliefs in aluminium, with the albedo that keeps energy and bare, and Mitsuba's own."""
    diffraction = {name: {"type": "diffraction", **preset_skin(name), **ALUMINIUM} for name in RELIEFS}
    return {
        **diffraction,
        **{f"{name}, bare": {**each, "conserve_energy": False} for name, each in diffraction.items()},
        REFERENCE: {"type": "roughconductor", "alpha": ALPHA, **ALUMINIUM},
    }


def figures(variants: tuple = VARIANTS) -> list[dict]:
    """Rows of {variant, name, threads, ns, ratio}; `ns` is by call, per element, `ratio` that to REFERENCE's."""
    rows = []
    for variant in variants:
        use_variant(variant, fall_back=False)
        made = {name: mi.load_dict(bsdf) for name, bsdf in bsdfs().items()}
        ns = {call: call_ns(made, call) for call in CALLS}
        for name in made:
            rows.append(
                {
                    "variant": variant,
                    "name": name,
                    "threads": dr.thread_count(),
                    "ns": {call: ns[call][name] for call in CALLS},
                    # Its pdf alone takes next to nothing, by which nothing can be divided.
                    "ratio": {call: ns[call][name] / ns[call][REFERENCE] for call in CALLS if call != "pdf"},
                }
            )
    return rows


def call_ns(bsdfs: dict[str, mi.BSDF], call: str, wavefront: int | None = None) -> dict[str, float]:
    """Time per element of one call of each, less that of a kernel which only reads and writes as much.

    Each has `wavefront` elements, or as many as take about KERNEL_S. All take turns, so that what else the machine does
    falls on each; the least of the turns is taken, which is the one with the least of it.
    """
    kernels, elements, drawn = {}, {}, {}
    for name, bsdf in bsdfs.items():

        def called(inputs, bsdf=bsdf):
            return answer(bsdf, call, inputs)

        if wavefront is None:
            few = Inputs(FEWEST)
            elements[name] = fitting_elements(min(kernel_s(called, few) for _ in range(2)) / FEWEST)
        else:
            elements[name] = wavefront
        if elements[name] not in drawn:
            drawn[elements[name]] = Inputs(elements[name])
        inputs = drawn[elements[name]]
        kernels[name] = [lambda inputs=inputs, called=called: kernel_s(called, inputs)]
        kernels[name] += [lambda inputs=inputs: kernel_s(empty, inputs)]
    turns = [{name: [kernel() for kernel in both] for name, both in kernels.items()} for _ in range(TURNS)]
    least = {name: np.min([turn[name] for turn in turns], axis=0) for name in kernels}
    return {name: per_element_ns(*least[name], elements[name]) for name in kernels}


def per_element_ns(seconds: float, empty_s: float, elements: int) -> float:
    """At least a hundredth of a nanosecond: what is less is the clock's."""
    return max((seconds - empty_s) / elements * 1e9, 0.01)


def fitting_elements(seconds_per_element: float) -> int:
    """A power of two that takes about KERNEL_S."""
    wanted = KERNEL_S / max(seconds_per_element, 1e-12)
    return int(min(max(2 ** round(np.log2(wanted)), FEWEST), MOST))


class Inputs:
    """Pairs of directions above the surface, drawn by the cosine, wavelengths where the variant has them, and numbers
    to sample with."""

    def __init__(self, elements: int):
        rng = mi.PCG32(size=elements, initstate=SEED)

        def number():
            return rng.next_float32()

        self.si = dr.zeros(mi.SurfaceInteraction3f, elements)
        self.si.wi = mi.warp.square_to_cosine_hemisphere(mi.Point2f(number(), number()))
        self.wo = mi.warp.square_to_cosine_hemisphere(mi.Point2f(number(), number()))
        self.u1, self.u2 = number(), mi.Point2f(number(), number())
        if mi.is_spectral:
            self.si.wavelengths = mi.sample_rgb_spectrum(mi.sample_shifted(number()))[0]
        dr.eval(self.si, self.wo, self.u1, self.u2)
        dr.sync_thread()


def answer(bsdf: mi.BSDF, call: str, inputs: Inputs) -> mi.Float:
    """One number that needs everything which the call gives."""
    ctx = mi.BSDFContext()
    if call == "eval":
        return dr.sum(bsdf.eval(ctx, inputs.si, inputs.wo))
    if call == "pdf":
        return bsdf.pdf(ctx, inputs.si, inputs.wo)
    if call == "eval_pdf":
        value, pdf = bsdf.eval_pdf(ctx, inputs.si, inputs.wo)
        return dr.sum(value) + pdf
    sample, weight = bsdf.sample(ctx, inputs.si, inputs.u1, inputs.u2)
    return dr.sum(weight) + dr.sum(sample.wo) + sample.pdf


def empty(inputs: Inputs) -> mi.Float:
    """Reads what calls read, and writes what they write."""
    read = dr.sum(inputs.si.wi) + dr.sum(inputs.wo) + inputs.u1 + dr.sum(inputs.u2)
    return read + dr.sum(inputs.si.wavelengths) if mi.is_spectral else read


def kernel_s(called: Callable, inputs: Inputs) -> float:
    """Seconds in kernels, by Dr.Jit's own clock: neither tracing nor compiling is part of it."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(called(inputs))
        dr.sync_thread()
        return sum(kernel["execution_time"] for kernel in dr.kernel_history()) / 1e3
