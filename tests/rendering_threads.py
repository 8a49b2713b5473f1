"""Renders three scenes in three threads, each of which makes and changes BSDFs: `rendering_threads.py VARIANT ROUNDS`.

The scenes are made beforehand, since Mitsuba cannot make or delete scenes while others render.
"""

import gc
import sys
import threading

import mitsuba as mi
import numpy as np
from conftest import use_variant

PERIODS, LENGTHS = [1.5, 2.0, 2.5], [6.0, 9.0]
# Largest relative difference between kernels that contain different other BSDFs.
SINGLE = 1e-5


def bsdf(period):
    quick = {"tolerance": 0.01, "conserve_energy": False}
    return {"type": "diffraction", "preset": "blazed", "material": "Al", "period": period, **quick}


def scene(period):
    # The integrator evaluates without sampling, so that kernels compile quickly.
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0, -3, 3], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 4, "height": 4, "rfilter": {"type": "box"}},
            },
            "lamp": {"type": "point", "position": [0, 3, 3], "intensity": 10.0},
            "plate": {"type": "rectangle", "bsdf": bsdf(period)},
        }
    )


def picture(scene, coherence_length):
    params = mi.traverse(scene.shapes()[0].bsdf())
    params["coherence_length"] = coherence_length
    params.update()
    return np.array(mi.render(scene, spp=1, seed=1))


def main(variant, rounds):
    use_variant(variant)
    scenes = [scene(period) for period in PERIODS]
    wanted = [[picture(one, length) for length in LENGTHS] for one in scenes]
    failures = []

    def render(i, turn, kept):
        try:
            kept.append(mi.load_dict(bsdf(PERIODS[i])))
            which = turn % len(LENGTHS)
            np.testing.assert_allclose(picture(scenes[i], LENGTHS[which]), wanted[i][which], rtol=SINGLE)
        except Exception as error:
            failures.append(f"round {turn}: {error.__cause__ or error}")

    for turn in range(rounds):
        kept = []
        threads = [threading.Thread(target=render, args=(i, turn, kept)) for i in range(len(scenes))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        del kept
        gc.collect()
    print(*failures, sep="\n")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2])))
