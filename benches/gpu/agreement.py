"""Comparison of the checked variant's answers with those of its reference, on the same questions.

The reference is another variant of Mitsuba (variants.py). Both answer `eval`, `pdf`, `eval_pdf` and `sample`:

- Errors of values and densities are relative to the larger of both.
- The error of a sampled direction is the largest of its components.
- Of a sample, weight times density is compared with the reference's value in the sampled direction. The weight alone
  would not do: the density varies strongly within an order, so a rounded direction changes it.
- Colours are relative to their largest channel, and scalar colours are desaturated first (`in_kind`).
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

# Seed of the random questions.
SEED = 11
# Number of questions in a chunk. Chosen: the Mueller matrices of a million questions would fill the host's memory.
CHUNK = 1 << 18
# Fraction of outgoing directions that are uniform over the hemisphere. The others are sampled by the reference, so they
# lie in orders. Chosen.
UNIFORM = 0.2
# Floor of the scale of value errors, as a fraction of the density. Positions between orders are in single precision,
# with an error of 1.5e-7 of an order's largest power, which an order near its zero has as well (tests/test_twins.py).
VALUE_FLOOR = 4e-2
# Luminance Y of the linear sRGB channels (IEC 61966-2-1).
LUMINANCE = np.array([0.2126729, 0.7151522, 0.072175])
# Largest relative error of values and densities. Both implementations keep 1e-4 in single precision; 4096 questions to
# the scalar and LLVM variants gave at most 1e-5 in spectral variants and 5e-5 in colours.
RELATIVE = 1e-4
# Fraction of questions that may exceed RELATIVE: those whose digits cancel.
EXCEEDING = 1e-3
# Largest error of a component of a sampled direction: the rounding of differences of numbers up to 2, amplified by each
# reuse of a random number.
DIRECTION = 1e-3
# Fraction of samples that may exceed DIRECTION: a random number at the edge of an interval selects another order. 2e-4
# of the samples were measured to do so.
STRAY = 2e-3


def checks(plan: Plan, folder: Path, kind: str) -> Iterator[Check]:
    """One check per surface, for one kind of variant."""
    for name in plan.surfaces:
        yield f"{plan.variant(kind)}, {name}", partial(agree, plan, kind, surface(name))


def agree(plan: Plan, kind: str, parameters: dict, perturbed: dict | None = None) -> dict:
    """The figures of `judged`. `perturbed` are wrong parameters of the checked variant, for tests of this check."""
    variants = Pair(plan.variant(kind), reference(plan, kind))
    use(variants.reference)
    count = plan.scalar_questions if is_scalar() else plan.questions
    true = mi.load_dict({"type": "diffraction", **parameters})
    use(variants.checked)
    found = mi.load_dict({"type": "diffraction", **parameters, **(perturbed or {})})
    rng = np.random.default_rng(SEED)
    errors: list[dict] = []
    for start in range(0, count, CHUNK):
        asked = drawn(rng, min(CHUNK, count - start))
        errors.append(chunk_errors(variants, true, found, asked, rng))
    # Dr.Jit compiles every living BSDF into the kernels that follow, so these two are freed.
    del true, found
    gc.collect()
    figures = judged({name: np.concatenate([each[name] for each in errors]) for name in errors[0]})
    return {"reference": variants.reference, "questions": count, **figures}


@dataclass(frozen=True)
class Pair:
    """The names of the checked variant and of its reference."""

    checked: str
    reference: str


def chunk_errors(variants: Pair, true: mi.BSDF, found: mi.BSDF, asked: Questions, rng: np.random.Generator) -> dict:
    """The errors of a chunk of questions by call, arrays (n,)."""
    use(variants.reference)
    sampled = ask(true, asked)
    elsewhere = (sampled.sampled_pdf == 0) | (rng.random(asked.count) < UNIFORM)
    wo = np.where(elsewhere, asked.wo, sampled.sampled_wo).astype(np.float32)
    asked = replace(asked, wo=wo)
    expected = ask(true, asked)
    use(variants.checked)
    answered = ask(found, asked)
    there = replace(asked, wo=answered.sampled_wo.astype(np.float32))
    use(variants.reference)
    at_sample = ask(true, there)
    return errors_of(answered, expected, at_sample, in_kind(variants))


def errors_of(answered: Answers, expected: Answers, at_sample: Answers, comparable: Callable) -> dict:
    """The errors (n,) by call. `at_sample` are the reference's answers in the checked variant's sampled directions.

    `comparable` is a function of `in_kind`.
    """
    # A density of 0 marks a sample without light, whose weight must be 0.
    is_valid = answered.sampled_pdf > 0
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
        # No error: the density, by which `judged` rejects a comparison in which most questions have no light.
        "light": expected.pdf,
    }


def in_kind(variants: Pair) -> Callable:
    """A function that makes two arrays of values (…, channels, n) comparable, and returns them with the error scale."""
    if variants.checked.endswith("_mono"):
        if variants.reference.endswith("_rgb"):
            # Where channels cancel, the luminance has the absolute error of the channels.
            return lambda mono, rgb: (mono, (LUMINANCE @ rgb)[None], largest(np.abs(rgb))[None])
        return lambda ours, theirs: (ours, theirs, larger(ours, theirs))
    if variants.reference == "scalar_rgb":
        return lambda ours, theirs: scaled_by_colour(desaturated(ours), theirs)
    if variants.reference.endswith("_rgb"):
        return scaled_by_colour
    if variants.reference.endswith("_polarized"):
        return lambda ours, theirs: (ours, theirs, larger(ours, theirs)[:1, :1])
    return lambda ours, theirs: (ours, theirs, larger(ours, theirs))


def largest(errors: np.ndarray) -> np.ndarray:
    """The largest error of each question (n,); NaN becomes infinity."""
    return np.nan_to_num(errors.reshape(-1, errors.shape[-1]).max(axis=0), nan=np.inf, posinf=np.inf)


def larger(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """The larger of both magnitudes."""
    return np.maximum(np.abs(ours), np.abs(theirs))


def scaled_by_colour(ours: np.ndarray, theirs: np.ndarray) -> tuple:
    """Colours with their largest channel as the scale: channels cancel in out-of-gamut colours."""
    return ours, theirs, largest(larger(ours, theirs))[None]


def desaturated(rgb: np.ndarray) -> np.ndarray:
    """Colours (3, n), mixed with grey of their luminance until no channel is negative, as scalar variants do."""
    grey, least = np.maximum(LUMINANCE @ rgb, 0), rgb.min(axis=0)
    saturation = np.where(least < 0, grey / np.maximum(grey - least, 1e-30), 1)
    return np.maximum(grey + saturation * (rgb - grey), 0)


def relative(ours: np.ndarray, theirs: np.ndarray, scale: np.ndarray, pdf: np.ndarray) -> np.ndarray:
    """The largest error of each question, relative to `scale` or VALUE_FLOOR of the density."""
    return largest(np.abs(ours - theirs) / np.maximum(np.maximum(scale, VALUE_FLOOR * pdf), 1e-30))


def relative_density(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """The error of each density, relative to the larger of both."""
    return largest(np.abs(ours - theirs) / np.maximum(np.maximum(ours, theirs), 1e-30))


def judged(errors: dict[str, np.ndarray]) -> dict:
    """The quantiles of each call's errors, the fraction above RELATIVE, and whether all limits are kept."""
    figures: dict = {"passed": bool(np.mean(errors["light"] > 0) > 0.5)}
    for name in ("eval", "pdf", "eval_pdf", "sample"):
        exceeding = float(np.mean(errors[name] > RELATIVE))
        figures[name] = {
            "median": float(np.median(errors[name])),
            "p999": float(np.quantile(errors[name], 0.999, method="higher")),
            "max": float(errors[name].max()),
            "exceeding": exceeding,
        }
        figures["passed"] = figures["passed"] and exceeding <= EXCEEDING
    stray = float(np.mean(errors["direction"] > DIRECTION))
    figures["stray"] = stray
    figures["passed"] = figures["passed"] and stray <= STRAY
    return figures
