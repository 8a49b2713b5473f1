"""Writes the hits of Mitsuba's camera rays on the snake, for crates/realtime/tests/realtime/pictures.rs.

Run it from the repository after `make tool`: PYTHONPATH=. .venv/bin/python scripts/mitsuba_hits.py
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path

import mitsuba as mi

REPOSITORY = Path(__file__).resolve().parent.parent
HITS = REPOSITORY / "crates/realtime/tests/realtime/data/mitsuba_hits.json"
WIDTH, HEIGHT = 36, 24


def main() -> None:
    mi.set_variant("scalar_rgb")
    from mitsuba_scenes.light import Light
    from mitsuba_scenes.scene import SOIL, View

    to_sun = mi.Vector3f(Light().to_sun())
    view = View(WIDTH, HEIGHT)
    with tempfile.TemporaryDirectory() as folder:
        mesh = Path(folder) / "snake.ply"
        subprocess.run([REPOSITORY / "target/release/sunbeam", "snake", "-o", mesh], check=True, capture_output=True)
        sensor = mi.load_dict(view.sensor(1))
        scene = mi.load_dict(
            {
                "type": "scene",
                "snake": {"type": "ply", "filename": str(mesh), "id": "snake"},
                "ground": {
                    "type": "rectangle",
                    "to_world": mi.ScalarTransform4f().scale(200),
                    "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(SOIL)}},
                },
            }
        )
    pixels = []
    for y in range(HEIGHT):
        for x in range(WIDTH):
            ray, _ = sensor.sample_ray(0, 0.5, [(x + 0.5) / WIDTH, (y + 0.5) / HEIGHT], [0.5, 0.5])
            si = scene.ray_intersect(ray)
            if not si.is_valid():
                pixels.append(None)
                continue
            skin = si.shape.id() == "snake"
            to_viewer, light = si.wi, si.to_local(to_sun)
            # `twosided` turns directions below the surface to its front.
            if to_viewer.z < 0:
                to_viewer.z, light.z = -to_viewer.z, -light.z
            lit = bool(light.z > 0 and not scene.ray_test(si.spawn_ray(to_sun)))
            rounded = [float(f"{value:.7g}") for value in [*light, *to_viewer, *si.uv]]
            pixels.append({"skin": skin, "lit": lit, "wi_wo_uv": rounded})
    out = {"mitsuba": mi.__version__, "width": WIDTH, "height": HEIGHT, "pixels": pixels}
    text = json.dumps(out).replace('{"skin"', '\n{"skin"')
    HITS.write_text(text + "\n")
    print(sum(bool(p and p["skin"]) for p in pixels), "pixels of skin")


if __name__ == "__main__":
    main()
