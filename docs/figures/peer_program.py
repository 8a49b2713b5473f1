"""Another's program for one coherent patch of a height field, WaveOpticsBrdf of Yan et al. 2018, run from Python.

It is not part of this repository; docs/peers.md says where to get it and how to build it.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType

import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import SetupError

from .peer_sums import Patch, hemisphere

# The largest number that the program's pictures can hold: they are of half floats.
HALF_MAX = 65504.0


def peer_program() -> Path | None:
    """The program that the environment names in `PEER`; `None` where it names none."""
    named = os.environ.get("PEER")
    if not named:
        return None
    program = Path(named).expanduser().resolve()
    if not os.access(program, os.X_OK) or program.is_dir():
        raise SetupError(f"PEER={named} is not a program; docs/peers.md says how to build it")
    return program


def peer_heights(heights: np.ndarray, pixel_um: float) -> np.ndarray:
    """Heights `[iy, ix]` in µm as the program has them: `[ix, iy]`, half floats, in units of a pixel's edge."""
    return (heights.T / pixel_um).astype(np.float16)


def peer_words(shape: tuple[int, int], pixel_um: float, patch: Patch, size: int) -> list[str]:
    """The program's options for a patch in the middle of a tile of so many rows and columns, lengths in µm.

    Its pixels have their heights in their middle, half a pixel from where its coordinates begin.
    """
    ny, nx = shape
    x, y, z = patch.wi
    return [
        *("-m", "Wave", "-d", "RGHS", "-w", repr(pixel_um), "-l", repr(patch.wavelength_um), "-r", str(size)),
        *("-x", repr((nx // 2 + 0.5) * pixel_um), "-y", repr((ny // 2 + 0.5) * pixel_um), "-p", repr(patch.window_um)),
        *("-s", repr(float(x / z)), "-t", repr(float(y / z))),
    ]


def from_peer(answer: np.ndarray, patch: Patch, wo: np.ndarray) -> np.ndarray:
    """`f_r` in 1/sr with unit obliquity, of what the program answers for directions `[n, 3]`.

    Its factor is `w² / (4 cosθi cosθo)`.
    """
    cos_i, cos_o = patch.wi[2], wo[:, 2]
    return answer * 4 * cos_i * cos_o / (cos_i + cos_o) ** 2


def run_peer(program: Path, heights: np.ndarray, pixel_um: float, patch: Patch, size: int) -> tuple[np.ndarray, float]:
    """The program's `f_r` in 1/sr over the map's directions, and the seconds of one core that it took."""
    with TemporaryDirectory() as folder:
        relief, answered = Path(folder) / "relief.exr", Path(folder) / "answer.exr"
        channels = np.repeat(peer_heights(heights, pixel_um)[..., None], 3, axis=-1)
        mi.Bitmap(channels).write(str(relief))
        words = [
            str(program),
            "-i",
            str(relief),
            "-o",
            str(answered),
            *peer_words(heights.shape, pixel_um, patch, size),
        ]
        _, seconds = core_seconds(words)
        # Its rows run along +x.
        picture = np.array(mi.Bitmap(str(answered)), dtype=np.float64)[..., 0].T
    wo, lit = hemisphere(size)
    if not np.all(np.isfinite(picture)) or picture.max() >= HALF_MAX:
        raise SetupError(f"the program's half floats overflow for {patch}")
    return from_peer(picture[lit], patch, wo), seconds


def core_seconds(
    words: list[str], stdin: str = "", variables: Mapping[str, str] = MappingProxyType({})
) -> tuple[str, float]:
    """Runs a program on one thread, with these variables too: what it printed, and the seconds of a core that it took.

    Not those of the wall: other programs on the machine count less.
    """
    before = os.times()
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1", **variables}
    done = subprocess.run(words, input=stdin, capture_output=True, text=True, env=environment)
    after = os.times()
    if done.returncode != 0:
        raise SetupError(f"`{Path(words[0]).name}` failed: {(done.stderr or done.stdout).strip()[-300:]}")
    return done.stdout, after.children_user + after.children_system - before.children_user - before.children_system
