"""The variants of Mitsuba: selection, and the reference with which a checked variant is compared."""

from __future__ import annotations

from functools import cache

import drjit as dr
import mitsuba as mi

from mitsuba_scenes.environment import use_variant

from .plan import Plan


def use(name: str) -> None:
    """Selects a variant; raises `mitsuba_scenes.environment.SetupError` with the reason if it does not run here."""
    use_variant(name, fall_back=False)


@cache
def has_llvm() -> bool:
    """Whether variants of the LLVM backend run here."""
    return bool(dr.has_backend(dr.JitBackend.LLVM))


def reference(plan: Plan, kind: str) -> str:
    """Name of the variant with which `plan.variant(kind)` is compared. `kind` is the end of both names, such as "rgb".

    - A card's variants are compared with LLVM, which runs the same traced code.
    - Without LLVM, and in the dry run, which checks LLVM, the reference is scalar: the Rust core, called ray by ray.
    - Mitsuba's package has no variant `scalar_mono`. In its place stands the RGB variant of the checked backend; the
      caller takes the luminance of its answers.
    """
    if not plan.dry and has_llvm():
        return f"llvm_ad_{kind}"
    return plan.variant("rgb") if kind == "mono" else f"scalar_{kind}"


def is_scalar() -> bool:
    """Whether the variant in use is scalar, and so evaluates one ray or pair of directions at a time."""
    return mi.variant().startswith("scalar")
