"""A render of a scene file in which the surface replaces one of the BSDFs."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ..errors import SweepError
from ..limits import LIGHT, Numbers, Text, shown
from ..pictures import exr, png, thumbnail
from ..reflector import ReflectorError, mitsuba, one_line, one_thread, use_variant
from .exposed import exposed
from .want import Answer, Column, Options, Question, Want, WantError

# Parameters with numbers that Mitsuba takes as spectra; other numbers are `float` elements.
_SPECTRA = ("specular_reflectance", "diffuse_reflectance", "eta", "k")
# Largest number of paths in one pass, about 4 GB at 1 kB a path. Chosen.
_PATHS_PER_PASS = 1 << 22
# Largest number of paths of a render. Chosen: more would take days on any machine.
_PATHS_MAX = 1 << 34


@dataclass(frozen=True)
class Render(Want):
    """``[want.render]``: ``scene``, a file of Mitsuba's; ``bsdf``, the id of the BSDF that the surface replaces
    (``surface``); ``spp`` (64); ``seed`` (0); ``variant`` (``llvm_ad_spectral``); ``exposure`` (that at which 1 %
    clips); ``parameters``, a table of the scene's own ``$parameters``.

    A BSDF of type ``diffraction`` keeps the parameters that the case does not give, such as a pigment or a rotation.
    The scene has its own light. ``theta_i_deg`` and ``phi_i_deg`` serve only a scene that uses ``$theta_i_deg`` and
    ``$phi_i_deg``.
    """

    scene: str
    path: Path
    digest: str
    bsdf: str
    spp: int
    seed: int
    variant: str
    exposure: float
    parameters: tuple[tuple[str, str], ...]

    name = "render"

    @classmethod
    def read(cls, table: object, folder: Path) -> Render:
        keys = ["scene", "bsdf", "spp", "seed", "variant", "exposure", "parameters"]
        options = Options(cls.name, table, keys)
        if "scene" not in options.table:
            raise SweepError("want.render: needs scene, a file of Mitsuba's")
        scene = options.choice("scene", "", Text())
        path = (folder / scene).resolve()
        bsdf = options.choice("bsdf", "surface", Text())
        try:
            content = path.read_bytes()
            root = ElementTree.fromstring(content)
        except OSError as error:
            raise SweepError(f"want.render: scene {scene} cannot be read: {error.strerror}") from error
        except ElementTree.ParseError as error:
            raise SweepError(f"want.render: scene {scene} is not XML: {error}") from error
        known = [str(one.get("id")) for one in root.iter("bsdf") if one.get("id")]
        if known.count(bsdf) != 1:
            raise SweepError(
                f"want.render: scene {scene} has {known.count(bsdf)} BSDFs with the id {bsdf!r}, but needs one; "
                f"its ids are {', '.join(known) or 'none'}"
            )
        given = options.table.get("parameters", {})
        if not isinstance(given, dict) or not all(isinstance(one, (str, int, float)) for one in given.values()):
            raise SweepError(f"want.render: parameters is {shown(given)}, but must be a table of numbers and texts")
        exposure = 0.0
        if "exposure" in options.table:
            exposure = options.number("exposure", 1.0, Numbers(0, 1e9, open_low=True))
        return cls(
            scene,
            path,
            hashlib.sha256(content).hexdigest(),
            bsdf,
            options.whole("spp", 64, 1, 1_000_000),
            options.whole("seed", 0, 0, 2**31),
            options.choice("variant", "llvm_ad_spectral", Text()),
            exposure,
            tuple(sorted((str(key), str(value)) for key, value in given.items())),
        )

    def identity(self) -> dict[str, Any]:
        keys = ("scene", "digest", "bsdf", "spp", "seed", "variant", "exposure", "parameters")
        return {"want": self.name, **{key: getattr(self, key) for key in keys}}

    def columns(self) -> list[Column]:
        return [
            Column("exposure", "number", "factor on the PNG's linear values"),
            *(Column(f"mean_{channel}", "number", f"mean of the picture, linear sRGB {channel}") for channel in "rgb"),
            Column("exr", "text", "the picture as EXR, linear sRGB, below the sweep's folder"),
            Column("png", "text", "the picture as PNG"),
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
        """The picture of the scene with the case's surface, linear sRGB ``[height, width, 3]``, rendered in passes."""
        mi = mitsuba()
        use_variant(self.variant)
        resolver = mi.file_resolver()
        before = [str(folder) for folder in resolver]
        text = self._scene_with(question)
        given = dict(self.parameters)
        for name in LIGHT:
            if f"${name}" in text:
                given[name] = repr(getattr(question, name))
        try:
            # Meshes and textures are relative to the scene's folder.
            resolver.prepend(str(self.path.parent))
            scene = mi.load_string(text, **given)
            width, height = (int(side) for side in scene.sensors()[0].film().crop_size())
            if width * height * self.spp > _PATHS_MAX:
                raise WantError(
                    f"{width} × {height} pixels with {self.spp} samples are {width * height * self.spp:.2g} "
                    f"paths; accepted are at most {_PATHS_MAX:.2g}"
                )
            passes = max(1, -(-width * height * self.spp // _PATHS_PER_PASS))
            # The first passes take the remainder, one sample each.
            counts = [self.spp // passes + (number < self.spp % passes) for number in range(passes)]
            total: Any = 0.0
            for number, spp in enumerate(count for count in counts if count):
                with one_thread():
                    one = np.array(mi.render(scene, spp=spp, seed=self.seed + number)).astype(np.float64)
                total = total + one * (spp / self.spp)
        except RuntimeError as error:
            raise ReflectorError(f"{one_line(error)}") from error
        finally:
            resolver.clear()
            for folder in before:
                resolver.append(folder)
        return total[..., :3] if total.shape[-1] >= 3 else np.repeat(total[..., :1], 3, axis=-1)

    def _scene_with(self, question: Question) -> str:
        """The scene's XML with the case's surface."""
        root = ElementTree.parse(self.path).getroot()
        (element,) = [one for one in root.iter("bsdf") if one.get("id") == self.bsdf]
        given = {name: value for name, value in question.parameters.items() if name not in LIGHT}
        if element.get("type") != "diffraction":
            for child in list(element):
                element.remove(child)
            element.set("type", "diffraction")
        # A preset replaces a file, and a material replaces an index.
        replaced = set(given)
        for one, others in (
            ("preset", {"filename"}),
            ("filename", {"preset"}),
            ("material", {"eta", "k"}),
            ("eta", {"material"}),
        ):
            if one in given:
                replaced |= others
        for child in list(element):
            if child.get("name") in replaced:
                element.remove(child)
        for name, value in given.items():
            if isinstance(value, bool):
                kind, written = "boolean", str(value).lower()
            elif isinstance(value, float):
                kind, written = "spectrum" if name in _SPECTRA else "float", repr(value)
            else:
                kind, written = "string", str(value)
            ElementTree.SubElement(element, kind, {"name": name, "value": written})
        return ElementTree.tostring(root, encoding="unicode")
