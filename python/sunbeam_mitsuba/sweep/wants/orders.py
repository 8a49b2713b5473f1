"""Directions and efficiencies of a grating's diffraction orders, computed by ``sunbeam orders``.

The efficiency of an order is its fraction of the incident light. There are two theories: the scalar one, in which the
relief only delays the wave, and the rigorous one, Maxwell's equations.

A *want* is a group of figures of a sweep. Its *question* is a case, a surface under a setting, and its *answer* has the
figures and pictures (want.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..command import ask, require_command, surface_words
from ..errors import SweepError
from ..limits import Value, shown
from .want import Answer, Column, Options, Question, Want

# Theories in the order of the table's columns.
_THEORIES = ("scalar", "rigorous")
# Parameters that the rigorous theory refuses, left out for it.
_SCALAR_ONLY = ("model", "obliquity", "shadowing", "conserve_energy")


@dataclass(frozen=True)
class Orders(Want):
    """``[want.orders]``: ``wavelengths_nm`` (450, 550, 650) and ``theories`` (both).

    Defaults are in parentheses. The relief must vary along x alone. The surface's own ``theory`` is ignored.
    """

    wavelengths_nm: tuple[float, ...]
    #: Names among _THEORIES, in this order.
    theories: tuple[str, ...]

    name = "orders"

    @classmethod
    def read(cls, table: object, folder: Path) -> Orders:
        options = Options(cls.name, table, ["wavelengths_nm", "theories"])
        theories = options.table.get("theories", list(_THEORIES))
        if not isinstance(theories, list) or not theories or any(theory not in _THEORIES for theory in theories):
            raise SweepError(
                f"want.orders: theories is {shown(theories)}, but must be a list of {', '.join(_THEORIES)}"
            )
        return cls(
            wavelengths_nm=options.wavelengths_nm((450.0, 550.0, 650.0)),
            theories=tuple(theory for theory in _THEORIES if theory in theories),
        )

    def identity(self) -> dict[str, Any]:
        return {"want": self.name, "wavelengths_nm": list(self.wavelengths_nm), "theories": list(self.theories)}

    def columns(self) -> list[Column]:
        columns = [
            Column(f"{theory}_reflected", "number", f"{theory}: reflected fraction of unpolarised light, mean over λ")
            for theory in self.theories
        ]
        listed = "theory, wavelength in nm, side, order, direction in degrees and efficiencies of each order"
        return [*columns, Column("list", "orders", listed)]

    def check_parameters(self, names: set[str], values: Mapping[str, set[Value]]) -> None:
        # Parameters of the plugin for which `sunbeam orders` has no argument.
        for name in ("material", "rotation", "int_ior", "ext_ior"):
            if name in names:
                raise SweepError(f"want.orders: {name} is not known to it; give eta and k, and phi_i_deg")

    def check_here(self) -> None:
        require_command()

    def compute(self, question: Question) -> Answer:
        answer = Answer()
        # The entry of the column `list`: all orders.
        rows = []
        for theory in self.theories:
            # The option `--theory` names the theory.
            left_out = ("theory", *(_SCALAR_ONLY if theory == "rigorous" else ()))
            parameters = {name: value for name, value in question.parameters.items() if name not in left_out}
            options = [f"--theta-i={question.theta_i_deg!r}", f"--phi-i={question.phi_i_deg!r}", f"--theory={theory}"]
            # Sum of the reflected efficiencies over wavelengths and orders.
            reflected = 0.0
            for nm in self.wavelengths_nm:
                report = ask("orders", "--json", *options, f"--wavelength={nm!r}", *surface_words(parameters))
                for order in report["orders"]:
                    # Efficiencies: `te` and `tm` by polarisation, which the scalar theory lacks, and `mean` of both.
                    kept = {key: order.get(key) for key in ("order", "theta_deg", "phi_deg", "te", "tm", "mean")}
                    # Bodies that transmit have orders on both sides. Reports on other surfaces name no side.
                    side = order.get("side", "above")
                    rows.append({"theory": theory, "wavelength_nm": nm, "side": side, **kept})
                    if side == "above":
                        reflected += order["mean"]
            answer.number(f"{theory}_reflected", reflected / len(self.wavelengths_nm))
        answer.figures["list"] = rows
        return answer
