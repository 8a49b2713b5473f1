"""Derivatives of a BSDF by its parameters, in forward and backward mode, compared with central differences."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import drjit as dr
import mitsuba as mi

from .parts import Check
from .plan import Plan
from .samples import direction
from .variants import use

# A surface with small tables and wide orders, with lengths in µm and the rotation in degrees. The diffuse part gives
# light in every direction.
SURFACE = {
    "preset": "blazed",
    "period": 2.0,
    "coherence_length": 6.0,
    "tolerance": 0.01,
    "conserve_energy": False,
    "eta": 1.56,
    "k": 0.3,
    "diffuse_reflectance": 0.4,
    "specular_reflectance": 0.8,
    "rotation": 10.0,
}
# Unit vectors away from the surface, by the angle with the normal and the azimuth in degrees. OUTGOING is on the slope
# of the first order, which is 5 degrees wide: every parameter has an effect there.
INCIDENT, OUTGOING = direction(40, 20), direction(20, 200)
# Wavelengths of the four spectral channels; arbitrary values, spread over the visible range.
WAVELENGTHS_NM = [430, 520, 580, 650]
# Half the step of the central difference for parameters without unit, all but the rotation. Larger steps add error by
# curvature, smaller ones by rounding.
STEP = 1e-2
# Half the step for the rotation in degrees: small compared with the orders' width of 5 degrees.
STEP_DEG = 5e-2
# Accepted relative error of a derivative, equal to that of tests/test_plugin_live.py. It covers the rounding of values,
# about 1e-7 over a step of 1e-2, and the curvature over the step.
RELATIVE = 1e-2


def checks(plan: Plan, folder: Path) -> Iterator[Check]:
    """One check per kind of variant, such as `rgb`, and parameter. No file is written to `folder`."""
    for kind in plan.kinds:
        for parameter in plan.derivatives:
            yield f"{plan.variant(kind)}, by {parameter}", partial(compared, plan.variant(kind), parameter)


def compared(variant: str, parameter: str) -> dict:
    """Compares derivatives of the BSDF's value, summed over channels, by one parameter.

    Returns the central difference as `difference`, and the derivatives by Dr.Jit's modes as `backwards` and `forwards`.
    """
    use(variant)
    bsdf = mi.load_dict({"type": "diffraction", **SURFACE})
    parameters, key = mi.traverse(bsdf), f"{parameter}.value"
    value = mi.Float(parameters[key])
    step = STEP_DEG if parameter == "rotation" else STEP
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(INCIDENT)
    if mi.is_spectral:
        si.wavelengths = WAVELENGTHS_NM

    def summed_value(parameter_value):
        """Sets the parameter, and returns the BSDF's value summed over channels, an array of one element."""
        parameters[key] = parameter_value
        parameters.update()
        return dr.sum(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(OUTGOING)))

    expected = float(((summed_value(value + step) - summed_value(value - step)) / (2 * step))[0])
    found = {}
    for mode in ("backwards", "forwards"):
        variable = mi.Float(value)
        dr.enable_grad(variable)
        result = summed_value(variable)
        if mode == "backwards":
            dr.backward(result)
            gradient = dr.grad(variable)
        else:
            dr.forward(variable)
            gradient = dr.grad(result)
        found[mode] = float(gradient[0])
    # A derivative of zero would prove nothing.
    passed = expected != 0 and all(abs(each - expected) <= RELATIVE * abs(expected) for each in found.values())
    return {"passed": passed, "difference": expected, **found}
