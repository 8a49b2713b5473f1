"""Heights of surfaces by the command `sunbeam height-field`."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from mitsuba_scenes.tool import sunbeam


def height_field(*arguments) -> tuple[np.ndarray, dict]:
    """The heights in µm, [iy, ix] with y = 0 first, and the report of the command with these `arguments`."""
    with TemporaryDirectory() as folder:
        npy = Path(folder) / "heights.npy"
        report = json.loads(sunbeam("height-field", *arguments, "-o", npy))
        return np.load(npy), report
