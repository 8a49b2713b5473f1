"""A render of a Mitsuba scene file in which the surface of a sweep's case replaces one of the BSDFs.

The XML of the scene is edited and given to Mitsuba as a text. The picture is the mean of several passes, each of which
traces some of the samples per pixel.

A *want* is a group of figures of a sweep. Its *question* is a case, a surface under a setting, and its *answer* has the
figures and pictures (want.py).
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..errors import SweepError
from ..limits import LIGHT, Text, shown
from ..pictures import exr, png, thumbnail
from ..reflector import ReflectorError, last_line, mitsuba, one_thread, use_variant
from .exposed import exposed
from .want import Answer, Column, Options, Question, Want, WantError

# Parameters that a parameter of the case removes from the scene's BSDF, which refuses both together.
_REPLACED = {
    "preset": {"filename"},
    "filename": {"preset"},
    "material": {"eta", "k"},
    "eta": {"material", "int_ior", "ext_ior"},
    "int_ior": {"eta"},
    "ext_ior": {"eta"},
}
# Largest number of paths in a pass, rounded up to whole samples per pixel: about 4 GB, since Mitsuba keeps about 1 kB a
# path. Smaller values take less memory and more passes.
_PATHS_PER_PASS = 1 << 22
# Largest number of paths of a render. More would take days.
_PATHS_MAX = 1 << 34


@dataclass(frozen=True)
class Render(Want):
    """``[want.render]``: ``scene``, ``bsdf`` (``surface``), ``spp`` (64), ``seed`` (0), ``variant``
    (``llvm_ad_spectral``), ``exposure`` (automatic), ``parameters``.

    Defaults are in parentheses. ``scene`` is an XML file of Mitsuba, and ``bsdf`` the id of the BSDF that the surface
    replaces. A BSDF of type ``diffraction`` keeps the parameters that the case does not give, such as a pigment.
    ``parameters`` is a table of values for the scene's ``$names``. The scene has its own light, which can use the
    angles of the case's light as ``$theta_i_deg`` and ``$phi_i_deg``.
    """

    #: The scene's file as it was given.
    scene: str
    #: Absolute path of the scene's file.
    path: Path
    #: SHA-256 of the scene's file, without the files that it names.
    digest: str
    #: Id of the replaced BSDF.
    bsdf: str
    #: Samples per pixel.
    spp: int
    #: Seed of the first pass; later passes count up from it.
    seed: int
    #: Name of Mitsuba's variant.
    variant: str
    #: Factor on linear sRGB in the PNG; 0 for automatic exposure.
    exposure: float
    #: Names and values of the scene's ``$names``, sorted.
    parameters: tuple[tuple[str, str], ...]

    name = "render"

    @classmethod
    def read(cls, table: object, folder: Path) -> Render:
        keys = ["scene", "bsdf", "spp", "seed", "variant", "exposure", "parameters"]
        options = Options(cls.name, table, keys)
        if "scene" not in options.table:
            raise SweepError("want.render: needs scene, an XML file of Mitsuba")
        scene = options.choice("scene", "", Text())
        path = (folder / scene).resolve()
        bsdf = options.choice("bsdf", "surface", Text())
        content = _checked_scene(scene, path, bsdf)
        given = options.table.get("parameters", {})
        if not isinstance(given, dict) or not all(isinstance(value, (str, int, float)) for value in given.values()):
            raise SweepError(f"want.render: parameters is {shown(given)}, but must be a table of numbers and texts")
        return cls(
            scene=scene,
            path=path,
            digest=hashlib.sha256(content).hexdigest(),
            bsdf=bsdf,
            spp=options.whole("spp", 64, 1, 1_000_000),
            seed=options.whole("seed", 0, 0, 2**31),
            variant=options.choice("variant", "llvm_ad_spectral", Text()),
            exposure=options.exposure(),
            parameters=tuple(sorted((str(key), str(value)) for key, value in given.items())),
        )

    def identity(self) -> dict[str, Any]:
        keys = ("scene", "digest", "bsdf", "spp", "seed", "variant", "exposure", "parameters")
        return {"want": self.name, **{key: getattr(self, key) for key in keys}}

    def columns(self) -> list[Column]:
        return [
            Column("exposure", "number", "factor on the PNG's linear values"),
            *(Column(f"mean_{channel}", "number", f"mean of the picture, linear sRGB {channel}") for channel in "rgb"),
            Column("exr", "text", "the picture as EXR, linear sRGB, below the sweep's folder"),
            Column("png", "text", "the picture as PNG, sRGB, below the sweep's folder"),
        ]

    def check_here(self) -> None:
        mi = mitsuba()
        if self.variant not in mi.variants():
            raise SweepError(f"want.render: unknown variant {self.variant!r}; there are {', '.join(mi.variants())}")

    def compute(self, question: Question) -> Answer:
        pixels = self._rendered(question)
        answer, shown_pixels = exposed(pixels, pixels.reshape(-1, 3), self.exposure)
        answer.pictures = {"render.exr": exr(pixels), "render.png": png(shown_pixels)}
        answer.thumbnails["render"] = thumbnail(shown_pixels)
        return answer

    def _rendered(self, question: Question) -> Any:
        """The picture by the scene's first sensor with the case's surface, linear sRGB ``[height, width, 3]``.

        Raises :class:`WantError` for too many paths, and :class:`ReflectorError` where Mitsuba fails.
        """
        mi = mitsuba()
        use_variant(self.variant)
        resolver = mi.file_resolver()
        folders_before = [str(folder) for folder in resolver]
        text = self._scene_with(question)
        given = dict(self.parameters)
        # Mitsuba refuses values for names that the scene does not have, so only the scene's own angles of LIGHT
        # (theta_i_deg, phi_i_deg) are given.
        for name in LIGHT:
            if f"${name}" in text:
                given[name] = repr(getattr(question, name))
        try:
            # Meshes and textures are relative to the scene's folder.
            resolver.prepend(str(self.path.parent))
            scene = mi.load_string(text, **given)
            width, height = (int(side) for side in scene.sensors()[0].film().crop_size())
            mean: Any = 0.0
            for number, spp in enumerate(self._samples_of_passes(width, height)):
                # On one thread the picture's sums over samples keep their order.
                with one_thread():
                    picture = np.array(mi.render(scene, spp=spp, seed=self.seed + number)).astype(np.float64)
                mean = mean + picture * (spp / self.spp)
        except RuntimeError as error:
            raise ReflectorError(last_line(error)) from error
        finally:
            resolver.clear()
            for folder in folders_before:
                resolver.append(folder)
        # Alpha may follow the colours. A film of luminance has one channel, repeated here.
        return mean[..., :3] if mean.shape[-1] >= 3 else np.repeat(mean[..., :1], 3, axis=-1)

    def _samples_of_passes(self, width: int, height: int) -> list[int]:
        """Samples per pixel of each pass of a picture of ``width`` × ``height`` pixels, ``spp`` in all.

        Raises :class:`WantError` for too many paths.
        """
        paths = width * height * self.spp
        if paths > _PATHS_MAX:
            raise WantError(
                f"{width} × {height} pixels with {self.spp} samples are {paths:.2g} "
                f"paths; accepted are at most {_PATHS_MAX:.2g}"
            )
        # The division rounds up.
        passes = min(self.spp, -(-paths // _PATHS_PER_PASS))
        # The first passes have one sample of the remainder each.
        return [self.spp // passes + (number < self.spp % passes) for number in range(passes)]

    def _scene_with(self, question: Question) -> str:
        """The scene's XML with the case's surface in place of the BSDF of the id ``bsdf``."""
        root = ElementTree.parse(self.path).getroot()
        (bsdf,) = [element for element in root.iter("bsdf") if element.get("id") == self.bsdf]
        given = {name: value for name, value in question.parameters.items() if name not in LIGHT}
        # Parameters of other types mean nothing to the new BSDF.
        if bsdf.get("type") != "diffraction":
            for child in list(bsdf):
                bsdf.remove(child)
            bsdf.set("type", "diffraction")
        replaced = set(given).union(*(_REPLACED.get(name, set()) for name in given))
        for child in list(bsdf):
            if child.get("name") in replaced:
                bsdf.remove(child)
        for name, value in given.items():
            if isinstance(value, bool):
                kind, written = "boolean", str(value).lower()
            elif isinstance(value, float):
                # Mitsuba accepts a float for any spectrum. With the parameter `transmission`, `eta` must be a float.
                kind, written = "float", repr(value)
            elif isinstance(value, int):
                # The number of a channel, or the index of a medium.
                kind, written = "integer", str(value)
            else:
                kind, written = "string", str(value)
            ElementTree.SubElement(bsdf, kind, {"name": name, "value": written})
        return ElementTree.tostring(root, encoding="unicode")


def _checked_scene(scene: str, path: Path, bsdf: str) -> bytes:
    """Reads the scene's file at ``path``, named ``scene`` in messages, and returns its content.

    Raises :class:`SweepError` where it is no XML with exactly one BSDF of the id ``bsdf``.
    """
    try:
        content = path.read_bytes()
        root = ElementTree.fromstring(content)
    except OSError as error:
        raise SweepError(f"want.render: scene {scene} cannot be read: {error.strerror}") from error
    except ElementTree.ParseError as error:
        raise SweepError(f"want.render: scene {scene} is not XML: {error}") from error
    ids = [str(element.get("id")) for element in root.iter("bsdf") if element.get("id")]
    if ids.count(bsdf) != 1:
        raise SweepError(
            f"want.render: scene {scene} has {ids.count(bsdf)} BSDFs with the id {bsdf!r}, but needs one; "
            f"its ids are {', '.join(ids) or 'none'}"
        )
    return content
