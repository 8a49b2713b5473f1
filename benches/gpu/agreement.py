"""Answers of the checked variant beside those of its reference, on the same questions.

Errors of a question: values relative to the larger of both, densities likewise, sampled directions by their largest
component. A sample's weight times its density is held against the reference's value in the sampled direction, since
where a sample lies in its order moves its density.
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

SEED = 11
# Questions of a chunk: Mueller matrices of a million questions at a time would fill the host's memory.
CHUNK = 1 << 18
# Fraction of outgoing directions that are drawn anywhere; the others are samples, which lie where orders are.
ANYWHERE = 0.2
# Below this fraction of the density a value counts as this fraction: positions between orders are single precision,
# which leaves 1.5e-7 of an order's largest power, and an order near its zero is known no better (tests/test_twins.py).
VALUE_FLOOR = 4e-2
# Linear sRGB to luminance.
LUMINANCE = np.array([0.2126729, 0.7151522, 0.072175])


# Largest relative error of values and densities, and the fraction of questions that may exceed it. The twins promise
# each other 1e-4 in single precision; the scalar and LLVM variants were within 1e-5 in spectral variants and 5e-5 in
# colours (4096 questions). Among a million questions, a thousandth may lie where digits cancel.
RELATIVE, EXCEEDING = 1e-4, 1e-3
# Directions are differences of numbers up to 2 in single precision, out of random numbers that are stretched at each
# choice. A sample whose random number falls on the edge of an interval lands elsewhere; 0.02 % of them were seen to.
DIRECTION, STRAY = 1e-3, 2e-3


def checks(plan: Plan, folder: Path, kind: str) -> Iterator[Check]:
    for name in plan.surfaces:
        yield f"{plan.variant(kind)}, {name}", partial(agree, plan, kind, surface(name))


def agree(plan: Plan, kind: str, parameters: dict, perturbed: dict | None = None) -> dict:
    """Figures of each call. `perturbed` are parameters that only the checked variant gets, for proofs of the check."""
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
    # BSDFs that stay alive would be part of every kernel that follows.
    del true, found
    gc.collect()
    figures = judged({name: np.concatenate([each[name] for each in errors]) for name in errors[0]})
    return {"reference": variants.reference, "questions": count, **figures}


@dataclass(frozen=True)
class Pair:
    """The variant that is checked, and the one that is taken for true."""

    checked: str
    reference: str


def chunk_errors(variants: Pair, true: mi.BSDF, found: mi.BSDF, asked: Questions, rng: np.random.Generator) -> dict:
    """The errors of each call, arrays (n,) by name."""
    use(variants.reference)
    sampled = ask(true, asked)
    elsewhere = (sampled.sampled_pdf == 0) | (rng.random(asked.count) < ANYWHERE)
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
    """Errors of each call. `at_sample` are the reference's answers in the directions that were sampled.

    `comparable(ours, theirs)` brings values to what both can be held to, with the scale that errors are relative to.
    """
    kept = answered.sampled_pdf > 0
    seen = relative(*comparable(answered.weight * answered.sampled_pdf, at_sample.value), at_sample.pdf)
    density = relative_density(answered.sampled_pdf, at_sample.pdf)
    return {
        "eval": relative(*comparable(answered.value, expected.value), expected.pdf),
        "pdf": relative_density(answered.pdf, expected.pdf),
        "eval_pdf": np.maximum(
            relative(*comparable(answered.both_value, expected.both_value), expected.both_pdf),
            relative_density(answered.both_pdf, expected.both_pdf),
        ),
        "sample": np.where(kept, np.maximum(seen, density), largest(np.abs(answered.weight))),
        "direction": largest(np.abs(answered.sampled_wo - expected.sampled_wo)),
        # How much of what was compared is light: an answer of nothing agrees with everything.
        "light": expected.pdf,
    }


def in_kind(variants: Pair) -> Callable:
    """How values of the two variants are made comparable: (ours, theirs, scale), arrays (…, channels, n)."""
    if variants.checked.endswith("_mono"):
        if variants.reference.endswith("_rgb"):
            # Where channels cancel, the luminance is known as well as they are.
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
    """The largest of each question (n,); NaN becomes infinity."""
    return np.nan_to_num(errors.reshape(-1, errors.shape[-1]).max(axis=0), nan=np.inf, posinf=np.inf)


def larger(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    return np.maximum(np.abs(ours), np.abs(theirs))


def scaled_by_colour(ours: np.ndarray, theirs: np.ndarray) -> tuple:
    """Colours relative to their largest channel: channels cancel in out-of-gamut colours."""
    return ours, theirs, largest(larger(ours, theirs))[None]


def desaturated(rgb: np.ndarray) -> np.ndarray:
    """Colours (3, n) with grey of their luminance mixed in until no channel is negative, as in scalar variants."""
    grey, least = np.maximum(LUMINANCE @ rgb, 0), rgb.min(axis=0)
    share = np.where(least < 0, grey / np.maximum(grey - least, 1e-30), 1)
    return np.maximum(grey + share * (rgb - grey), 0)


def relative(ours: np.ndarray, theirs: np.ndarray, scale: np.ndarray, pdf: np.ndarray) -> np.ndarray:
    """The largest error of each question, relative to `scale` or VALUE_FLOOR of the density."""
    return largest(np.abs(ours - theirs) / np.maximum(np.maximum(scale, VALUE_FLOOR * pdf), 1e-30))


def relative_density(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    return largest(np.abs(ours - theirs) / np.maximum(np.maximum(ours, theirs), 1e-30))


def judged(errors: dict[str, np.ndarray]) -> dict:
    """Quantiles of each call's errors, the fraction that exceeds what is allowed, and whether all of that passes."""
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
