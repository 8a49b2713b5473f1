"""Time of one BSDF call in nanoseconds: large wavefronts through the Python API, minus an empty kernel."""

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
# Smallest number of elements of a wavefront, which gives a first estimate of the time.
FEWEST = 1 << 10
# Largest number of elements of a wavefront.
MOST = 1 << 21
# Target time of a kernel in seconds. Chosen.
KERNEL_S = 0.1
# Number of timed kernels of each material, in turn with the others.
TURNS = 7
# Seed of the random queries.
SEED = 1


def bsdfs() -> dict[str, dict]:
    """Two reliefs in aluminium, with and without energy conservation (*bare*), and Mitsuba's `roughconductor`."""
    diffraction = {name: {"type": "diffraction", **preset_skin(name), **ALUMINIUM} for name in RELIEFS}
    return {
        **diffraction,
        **{f"{name}, bare": {**each, "conserve_energy": False} for name, each in diffraction.items()},
        REFERENCE: {"type": "roughconductor", "alpha": ALPHA, **ALUMINIUM},
    }


def figures(variants: tuple = VARIANTS) -> list[dict]:
    """Rows of {variant, name, threads, ns, ratio}; `ns` is per element by call, `ratio` relative to REFERENCE."""
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
                    # The reference's pdf alone takes too little time for a ratio.
                    "ratio": {call: ns[call][name] / ns[call][REFERENCE] for call in CALLS if call != "pdf"},
                }
            )
    return rows


def call_ns(bsdfs: dict[str, mi.BSDF], call: str, wavefront: int | None = None) -> dict[str, float]:
    """Time per element of one call of each BSDF, minus that of a kernel with the same reads and writes.

    Wavefronts have `wavefront` elements, or as many as take about KERNEL_S. BSDFs take turns, and the smallest time of
    each counts, which is the least disturbed by other programs.
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
    """Time per element without the empty kernel's, at least 0.01 ns, the resolution of the clock."""
    return max((seconds - empty_s) / elements * 1e9, 0.01)


def fitting_elements(seconds_per_element: float) -> int:
    """The power of two of elements that take about KERNEL_S."""
    wanted = KERNEL_S / max(seconds_per_element, 1e-12)
    return int(min(max(2 ** round(np.log2(wanted)), FEWEST), MOST))


class Inputs:
    """Random inputs: pairs of directions drawn by the cosine, wavelengths in spectral variants, and sample numbers."""

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
    """A number that depends on all results of the call, so that none is optimised away."""
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
    """A kernel with the memory traffic of a call and no BSDF."""
    read = dr.sum(inputs.si.wi) + dr.sum(inputs.wo) + inputs.u1 + dr.sum(inputs.u2)
    return read + dr.sum(inputs.si.wavelengths) if mi.is_spectral else read


def kernel_s(called: Callable, inputs: Inputs) -> float:
    """Kernel time in seconds by Dr.Jit's clock, without tracing and compiling."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(called(inputs))
        dr.sync_thread()
        return sum(kernel["execution_time"] for kernel in dr.kernel_history()) / 1e3
