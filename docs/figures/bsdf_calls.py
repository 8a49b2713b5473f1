"""Time of one BSDF call in nanoseconds: kernels over large wavefronts through the Python API, minus an empty kernel.

A *wavefront* is an array of evaluations of a BSDF, its *elements*, that one kernel of Dr.Jit computes. The time of an
element is the time of the kernel over the number of elements. A kernel runs on all threads of Dr.Jit, or on the whole
graphics card, so a single thread takes longer for an element. The empty kernel only reads the inputs (`empty`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.skin import preset_skin

from .benchmark_scenes import ALPHA, ALUMINIUM, REFERENCE

# Measured variants of Mitsuba.
VARIANTS = ("llvm_ad_spectral", "llvm_ad_rgb")
# Presets of the measured reliefs.
RELIEFS = ("blazed", "xenopeltis")
# Measured methods of `mi.BSDF`.
CALLS = ("eval", "pdf", "eval_pdf", "sample")
# Smallest number of elements of a wavefront, which gives a first estimate of the time.
FEWEST = 1 << 10
# Largest number of elements of a wavefront, which bounds memory.
MOST = 1 << 21
# Target time of a kernel. Longer kernels are measured more precisely; shorter ones need less memory.
KERNEL_S = 0.1
# Number of timed kernels of each BSDF. More come closer to the time of an idle machine, and take longer.
TURNS = 7
# Smallest reported time of an element. By noise a call's kernel can seem no slower than the empty one, but ratios need
# a positive time. On a processor every call takes longer than this.
LEAST_NS = 0.01
# Seed of the random inputs; its value is arbitrary.
SEED = 1


def bsdfs() -> dict[str, dict]:
    """Dictionaries of BSDFs in aluminium by name: RELIEFS with and without energy conservation, and REFERENCE.

    REFERENCE is Mitsuba's rough mirror, with which times are compared.
    """
    diffraction = {name: {"type": "diffraction", **preset_skin(name), **ALUMINIUM} for name in RELIEFS}
    return {
        **diffraction,
        **{f"{name}, bare": {**each, "conserve_energy": False} for name, each in diffraction.items()},
        REFERENCE: {"type": "roughconductor", "alpha": ALPHA, **ALUMINIUM},
    }


def figures(variants: tuple = VARIANTS) -> list[dict]:
    """Rows of {variant, name, threads, ns, ratio}, one for each variant and BSDF.

    `threads` is the number of threads of a kernel. `ns` has nanoseconds per element by call, and `ratio` their ratios
    to those of REFERENCE.
    """
    rows = []
    for variant in variants:
        use_variant(variant, fall_back=False)
        loaded = {name: mi.load_dict(bsdf) for name, bsdf in bsdfs().items()}
        ns = {call: call_ns(loaded, call) for call in CALLS}
        for name in loaded:
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


def call_ns(materials: dict[str, mi.BSDF], call: str, wavefront: int | None = None) -> dict[str, float]:
    """Nanoseconds per element of one call, by the names of the BSDFs `materials`, minus those of an empty kernel.

    Wavefronts have `wavefront` elements; by default each BSDF gets a number that takes about KERNEL_S. BSDFs are timed
    in turn. The smallest time of each counts, since other programs only make kernels slower.
    """
    programs, elements = {}, {}
    for name, bsdf in materials.items():
        programs[name] = partial(reduced_result, bsdf, call)
        if wavefront is None:
            # The smaller of two times: other programs only make kernels slower.
            few = Inputs(FEWEST)
            elements[name] = fitting_elements(min(kernel_s(programs[name], few) for _ in range(2)) / FEWEST)
        else:
            elements[name] = wavefront
    # BSDFs with equally large wavefronts have the same inputs, which are evaluated once and stay in memory.
    inputs = {count: Inputs(count) for count in set(elements.values())}
    # Pairs of seconds by BSDF, one for each turn: the call's kernel and the empty kernel.
    seconds: dict[str, list] = {name: [] for name in materials}
    for _ in range(TURNS):
        for name in materials:
            shared = inputs[elements[name]]
            seconds[name].append((kernel_s(programs[name], shared), kernel_s(partial(empty, call), shared)))
    return {name: per_element_ns(*np.min(seconds[name], axis=0), elements[name]) for name in materials}


def per_element_ns(seconds: float, empty_s: float, elements: int) -> float:
    """Nanoseconds per element of a kernel, minus those of the empty kernel; at least LEAST_NS."""
    return max((seconds - empty_s) / elements * 1e9, LEAST_NS)


def fitting_elements(seconds_per_element: float) -> int:
    """The power of two, between FEWEST and MOST, at which a kernel takes about KERNEL_S."""
    # The lower bound avoids a division by 0.
    wanted = KERNEL_S / max(seconds_per_element, 1e-12)
    return int(min(max(2 ** round(np.log2(wanted)), FEWEST), MOST))


class Inputs:
    """Random inputs of `elements` evaluations, computed beforehand, so that kernels only read them.

    Directions `si.wi` and `wo` are cosine-distributed. `u1` (1D) and `u2` (2D) are the uniform random numbers of
    `sample`, and `si.uv` the texture coordinates, all in [0, 1). Spectral variants also have wavelengths.
    """

    def __init__(self, elements: int):
        rng = mi.PCG32(size=elements, initstate=SEED)

        def number() -> mi.Float:
            return rng.next_float32()

        self.si = dr.zeros(mi.SurfaceInteraction3f, elements)
        self.si.wi = mi.warp.square_to_cosine_hemisphere(mi.Point2f(number(), number()))
        self.wo = mi.warp.square_to_cosine_hemisphere(mi.Point2f(number(), number()))
        self.u1, self.u2 = number(), mi.Point2f(number(), number())
        if mi.is_spectral:
            self.si.wavelengths = mi.sample_rgb_spectrum(mi.sample_shifted(number()))[0]
        self.si.uv = mi.Point2f(number(), number())
        dr.eval(self.si, self.wo, self.u1, self.u2)
        dr.sync_thread()


def reduced_result(bsdf: mi.BSDF, call: str, inputs: Inputs) -> mi.Float:
    """Calls the BSDF; returns a number per element that depends on all results, so that none is optimised away."""
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


def empty(call: str, inputs: Inputs) -> mi.Float:
    """A number per element that depends on the call's directions, random numbers and wavelengths, without a BSDF.

    A BSDF may ignore an input: `roughconductor` reads no `u1`, and no wavelengths for `pdf`. The empty kernel reads it
    nevertheless, so the BSDF's time comes out slightly too small.
    """
    read = dr.sum(inputs.u2) + inputs.u1 if call == "sample" else dr.sum(inputs.wo)
    read = read + dr.sum(inputs.si.wi)
    return read + dr.sum(inputs.si.wavelengths) if mi.is_spectral else read


def kernel_s(called: Callable[[Inputs], mi.Float], inputs: Inputs) -> float:
    """Seconds in the kernel that evaluates `called(inputs)`, by Dr.Jit's clock, without tracing and compiling."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(called(inputs))
        dr.sync_thread()
        # Times of the history are in ms.
        return sum(kernel["execution_time"] for kernel in dr.kernel_history()) / 1e3
