"""Comparison of the BSDF in two variants of Mitsuba: the checked one, and its reference (variants.py).

The checked variant runs on the card, or by LLVM in a dry run. Both variants answer the same questions by the calls
`eval`, `pdf`, `eval_pdf` and `sample`. A question is one set of arguments: two directions, wavelengths and random
numbers (questions.py). Errors are measured as follows:

- Errors of values and densities are relative to the larger of the two numbers.
- Errors of colours are relative to the largest channel, those of Mueller matrices to the first element.
- The error of a sampled direction is the largest error of its components.
- The weight of a sample is compared by the product of weight and density, which is the BSDF's value. The reference's
  value is evaluated in the checked variant's direction: rounding moves the sampled direction, and weight and density
  alone vary strongly within an order.

Arrays have the axes (n,) for densities, (3, n) for directions, and (…, channels, n) for values, for n questions.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import mitsuba as mi
import numpy as np

from .parts import Check
from .plan import Plan
from .questions import Answers, Questions, ask, drawn
from .surfaces import surface
from .variants import is_scalar, reference, use

# Seed of the random questions; arbitrary.
SEED = 11
# Number of questions in a chunk. The Mueller matrices of a million questions at once would fill the host's memory.
CHUNK = 1 << 18
# Fraction of outgoing directions that are uniform over the hemisphere. The others are sampled by the reference, so they
# lie in diffraction orders, where values are large. Most of the uniform ones lie between orders. A larger fraction
# would test values between orders better, a smaller one those in orders.
UNIFORM = 0.2
# Smallest scale of a value's error, as a fraction of the density; both are in 1/sr. Where an order's power passes
# through zero, the value keeps an absolute error in single precision, which tests/test_twins.py derives.
VALUE_FLOOR = 4e-2
# Smallest divisor of a relative error: two zeros then have the error 0.
TINY = 1e-30
# Luminance Y of the linear sRGB channels (IEC 61966-2-1).
LUMINANCE = np.array([0.2126729, 0.7151522, 0.072175])
# Largest relative error of values and densities in single precision. 4096 questions to the scalar and LLVM variants
# gave at most 1e-5 in spectral variants and 5e-5 in colours.
RELATIVE = 1e-4
# Fraction of questions that may exceed RELATIVE. CUDA's roots are off by up to one unit in the last place, quotients by
# two. Such errors, put into the kernels, gave fractions up to 1.5e-3, on the rigorous grating in colours: its
# efficiencies vary as the root of the distance from an order's horizon. Directions changed by one unit in the last
# place give 1.2e-3 to 1.2e-2. A larger fraction would hide an error in few orders, a smaller one would reject rounding.
EXCEEDING = 3e-3
# Largest error of a component of a sampled direction. A random number is stretched to each interval that it selects,
# which amplifies its rounding.
DIRECTION = 1e-3
# Fraction of samples that may exceed DIRECTION, because a random number at the edge of an interval selects another
# order. The measured fraction is 2e-4.
STRAY = 2e-3

# A function that makes values of the checked variant (`ours`) and of the reference (`theirs`) comparable. It returns
# both and the scale of their error, which broadcasts with them.
Comparable = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


def checks(plan: Plan, folder: Path, kind: str) -> Iterator[Check]:
    """One check per surface, for one kind of variant: the end of its name, such as `rgb`."""
    for name in plan.surfaces:
        yield f"{plan.variant(kind)}, {name}", partial(agree, plan, kind, surface(name))


def agree(plan: Plan, kind: str, parameters: dict, perturbed: dict | None = None) -> dict:
    """The statistics of `judged` for a surface with these parameters, in the checked variant of a kind.

    `perturbed` are wrong parameters of the checked variant. Tests give them to show that this check detects errors.
    """
    variants = Pair(plan.variant(kind), reference(plan, kind))
    use(variants.reference)
    # A scalar reference answers one question after another, so it gets fewer.
    count = plan.scalar_questions if is_scalar() else plan.questions
    reference_bsdf = mi.load_dict({"type": "diffraction", **parameters})
    use(variants.checked)
    checked_bsdf = mi.load_dict({"type": "diffraction", **parameters, **(perturbed or {})})
    rng = np.random.default_rng(SEED)
    errors: list[dict] = []
    for start in range(0, count, CHUNK):
        asked = drawn(rng, min(CHUNK, count - start))
        errors.append(chunk_errors(variants, reference_bsdf, checked_bsdf, asked, rng))
    # Dr.Jit compiles every living BSDF into the kernels that follow, so these two are freed.
    del reference_bsdf, checked_bsdf
    gc.collect()
    statistics = judged({name: np.concatenate([each[name] for each in errors]) for name in errors[0]})
    return {"reference": variants.reference, "questions": count, **statistics}


@dataclass(frozen=True)
class Pair:
    """The names of the checked variant and of its reference."""

    checked: str
    reference: str


def chunk_errors(
    variants: Pair, reference_bsdf: mi.BSDF, checked_bsdf: mi.BSDF, asked: Questions, rng: np.random.Generator
) -> dict:
    """The errors (n,) of a chunk of questions, as from `errors_of`.

    All outgoing directions but a fraction UNIFORM are first replaced by samples of the reference.
    """
    use(variants.reference)
    sampled = ask(reference_bsdf, asked)
    # A sample of density 0 failed and has no direction.
    keeps_wo = (sampled.sampled_pdf == 0) | (rng.random(asked.count) < UNIFORM)
    wo = np.where(keeps_wo, asked.wo, sampled.sampled_wo).astype(np.float32)
    asked = replace(asked, wo=wo)
    expected = ask(reference_bsdf, asked)
    use(variants.checked)
    answered = ask(checked_bsdf, asked)
    asked_at_sample = replace(asked, wo=answered.sampled_wo.astype(np.float32))
    use(variants.reference)
    at_sample = ask(reference_bsdf, asked_at_sample)
    return errors_of(answered, expected, at_sample, comparison_for(variants))


def errors_of(answered: Answers, expected: Answers, at_sample: Answers, comparable: Comparable) -> dict:
    """The errors (n,) by call, of the checked variant's answers `answered` from the reference's answers `expected`.

    `at_sample` are the reference's answers in the checked variant's sampled directions. `both_value` and `both_pdf` are
    the results of `eval_pdf`. The entry `light` is no error: the expected densities, by which `judged` rejects a
    comparison in which most questions have no light.
    """
    # A density of 0 marks a sample without light. Its weight must be 0, so the error is the weight's magnitude. A NaN
    # counts as valid, so that its error is infinite.
    is_valid = answered.sampled_pdf != 0
    sampled_value = relative(*comparable(answered.weight * answered.sampled_pdf, at_sample.value), at_sample.pdf)
    density = relative_density(answered.sampled_pdf, at_sample.pdf)
    return {
        "eval": relative(*comparable(answered.value, expected.value), expected.pdf),
        "pdf": relative_density(answered.pdf, expected.pdf),
        "eval_pdf": np.maximum(
            relative(*comparable(answered.both_value, expected.both_value), expected.both_pdf),
            relative_density(answered.both_pdf, expected.both_pdf),
        ),
        "sample": np.where(is_valid, np.maximum(sampled_value, density), largest(np.abs(answered.weight))),
        "direction": largest(np.abs(answered.sampled_wo - expected.sampled_wo)),
        "light": expected.pdf,
    }


def comparison_for(variants: Pair) -> Comparable:
    """The function that makes values of these two variants comparable."""
    if variants.reference.endswith("_polarized"):
        return mueller_matrices
    if not variants.reference.endswith("_rgb"):
        return by_channel
    if variants.checked.endswith("_mono"):
        return luminances
    return desaturated_colours if variants.reference == "scalar_rgb" else colours


def by_channel(ours: np.ndarray, theirs: np.ndarray) -> tuple:
    """Spectral or mono values (channels, n), each relative to its own magnitude."""
    return ours, theirs, larger(ours, theirs)


def mueller_matrices(ours: np.ndarray, theirs: np.ndarray) -> tuple:
    """Mueller matrices (4, 4, channels, n), relative to their first element, the value for unpolarised light."""
    return ours, theirs, larger(ours, theirs)[:1, :1]


def colours(ours: np.ndarray, theirs: np.ndarray) -> tuple:
    """Colours (3, n), relative to their largest channel: digits cancel in small channels of saturated colours."""
    return ours, theirs, largest(larger(ours, theirs))[None]


def desaturated_colours(ours: np.ndarray, theirs: np.ndarray) -> tuple:
    """Colours (3, n) of the checked variant and of a scalar variant, which desaturates its colours."""
    return colours(desaturated(ours), theirs)


def luminances(mono: np.ndarray, rgb: np.ndarray) -> tuple:
    """Mono values (1, n) and the luminance of colours (3, n), relative to the largest channel.

    Where channels of the colour cancel, its luminance keeps their absolute error.
    """
    return mono, (LUMINANCE @ rgb)[None], largest(np.abs(rgb))[None]


def largest(errors: np.ndarray) -> np.ndarray:
    """The largest entry of each question (n,); NaN becomes infinity."""
    return np.nan_to_num(errors.reshape(-1, errors.shape[-1]).max(axis=0), nan=np.inf, posinf=np.inf)


def larger(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """The larger of both magnitudes."""
    return np.maximum(np.abs(ours), np.abs(theirs))


def desaturated(rgb: np.ndarray) -> np.ndarray:
    """Colours (3, n), mixed with grey of their luminance until no channel is negative, as scalar variants do."""
    grey, least = np.maximum(LUMINANCE @ rgb, 0), rgb.min(axis=0)
    saturation = np.where(least < 0, grey / np.maximum(grey - least, TINY), 1)
    return np.maximum(grey + saturation * (rgb - grey), 0)


def relative(ours: np.ndarray, theirs: np.ndarray, scale: np.ndarray, pdf: np.ndarray) -> np.ndarray:
    """The largest error of each question, relative to `scale` or, if it is larger, to VALUE_FLOOR times the density."""
    return largest(np.abs(ours - theirs) / np.maximum(np.maximum(scale, VALUE_FLOOR * pdf), TINY))


def relative_density(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """The error of each density, relative to the larger of both."""
    return largest(np.abs(ours - theirs) / np.maximum(np.maximum(ours, theirs), TINY))


def judged(errors: dict[str, np.ndarray]) -> dict:
    """Statistics of the errors that `errors_of` returns.

    Each call has the `median`, the 99.9 % quantile `p999`, the `max`, and the fraction `exceeding` RELATIVE. `stray` is
    the fraction of sampled directions with an error above DIRECTION, and `passed` the verdict.
    """
    # Dark answers would agree with any other dark answers, so most questions must have light.
    statistics: dict = {"passed": bool(np.mean(errors["light"] > 0) > 0.5)}
    for name in ("eval", "pdf", "eval_pdf", "sample"):
        exceeding = float(np.mean(errors[name] > RELATIVE))
        statistics[name] = {
            "median": float(np.median(errors[name])),
            "p999": float(np.quantile(errors[name], 0.999, method="higher")),
            "max": float(errors[name].max()),
            "exceeding": exceeding,
        }
        statistics["passed"] = statistics["passed"] and exceeding <= EXCEEDING
    stray = float(np.mean(errors["direction"] > DIRECTION))
    statistics["stray"] = stray
    statistics["passed"] = statistics["passed"] and stray <= STRAY
    return statistics
