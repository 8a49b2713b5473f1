"""Writes the hits of Mitsuba's camera rays on the snake and the ground, as a reference for the realtime renderer.

crates/realtime/tests/realtime/pictures.rs reads them. The file has the version of Mitsuba, the size of the picture, and
its pixels row by row from the top. A pixel is null for a ray without a hit, or an object:

- `skin`: whether the ray hit the snake, and not the ground;
- `lit`: whether the sun reaches the point from the viewer's side of the surface;
- `wi_wo_uv`: 8 numbers, the components of the unit vector to the sun and of that to the viewer, and the texture
  coordinates u and v. The vectors are in the shading frame: z is the shading normal, x points towards growing u.

Run it in the repository after `make tool`: PYTHONPATH=. .venv/bin/python scripts/mitsuba_hits.py
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path

import mitsuba as mi

from mitsuba_scenes.light import Light
from mitsuba_scenes.scene import View

REPOSITORY = Path(__file__).resolve().parent.parent
# The written file.
HITS = REPOSITORY / "crates/realtime/tests/realtime/data/mitsuba_hits.json"
# Size of the picture in pixels. Larger pictures cover more cases and enlarge the file in the repository.
WIDTH, HEIGHT = 36, 24


def hit(scene: mi.Scene, ray: mi.Ray3f, to_sun: mi.Vector3f) -> dict | None:
    """The entry of a pixel: the hit of its ray, as the head of this file describes; `None` without a hit."""
    si = scene.ray_intersect(ray)
    if not si.is_valid():
        return None
    # Mitsuba names the direction to the viewer `wi`; here `wi` is to the sun and `wo` to the viewer.
    wi, wo = si.to_local(to_sun), si.wi
    # Where the viewer sees the back of a surface, both directions are mirrored to the front, as by Mitsuba's BSDF
    # `twosided`.
    if wo.z < 0:
        wi.z, wo.z = -wi.z, -wo.z
    lit = bool(wi.z > 0 and not scene.ray_test(si.spawn_ray(to_sun)))
    # Seven digits, about the precision of the 32-bit floats.
    rounded = [float(f"{value:.7g}") for value in [*wi, *wo, *si.uv]]
    return {"skin": si.shape.id() == "snake", "lit": lit, "wi_wo_uv": rounded}


def main() -> None:
    """Traces a ray through the centre of each pixel and writes HITS."""
    mi.set_variant("scalar_rgb")
    to_sun = mi.Vector3f(Light().to_sun())
    view = View(WIDTH, HEIGHT)
    with tempfile.TemporaryDirectory() as folder:
        mesh = Path(folder) / "snake.ply"
        subprocess.run([REPOSITORY / "target/release/sunbeam", "snake", "-o", mesh], check=True, capture_output=True)
        # One sample per pixel; the rays below do not depend on this number.
        sensor = mi.load_dict(view.sensor(1))
        # Hits do not depend on materials and lights, which are left out. The ground reaches 200 cm to each side.
        scene = mi.load_dict(
            {
                "type": "scene",
                "snake": {"type": "ply", "filename": str(mesh), "id": "snake"},
                "ground": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(200)},
            }
        )
    pixels = []
    for y in range(HEIGHT):
        for x in range(WIDTH):
            # Time, random number of the wavelength, place on the film, and place on the aperture.
            ray, _ = sensor.sample_ray(0, 0.5, [(x + 0.5) / WIDTH, (y + 0.5) / HEIGHT], [0.5, 0.5])
            pixels.append(hit(scene, ray, to_sun))
    hits = {"mitsuba": mi.__version__, "width": WIDTH, "height": HEIGHT, "pixels": pixels}
    # A line for each pixel that was hit.
    text = json.dumps(hits).replace('{"skin"', '\n{"skin"')
    HITS.write_text(text + "\n")
    print(sum(pixel is not None and pixel["skin"] for pixel in pixels), "pixels of skin")


if __name__ == "__main__":
    main()
