"""Kinds of wants of a sweep, one class and file each; want.py has their base class.

A *want* (``[want.NAME]`` of a specification) is a group of computed figures with its options.
"""

from __future__ import annotations

from .brdf_map import BrdfMap
from .colour import Colour
from .orders import Orders
from .peaks import Peaks
from .render import Render
from .statistics import Statistics
from .want import Answer, Column, Question, Want, WantError

#: Kinds by their name in ``[want.NAME]``, in the order of their columns in the table of results.
WANTS: dict[str, type[Want]] = {kind.name: kind for kind in (Statistics, Peaks, Orders, Colour, BrdfMap, Render)}

__all__ = ["WANTS", "Answer", "Column", "Question", "Want", "WantError"]
