"""Renders three scenes in three threads, each of which makes and changes BSDFs: `rendering_threads.py VARIANT ROUNDS`.

The scenes are made beforehand, since Mitsuba cannot make or delete scenes while others render.
"""

import gc
import sys
import threading

import mitsuba as mi
import numpy as np
from conftest import use_variant

# Periods of the gratings in µm: one for each scene and thread.
PERIODS_UM = [1.5, 2.0, 2.5]
# Coherence lengths in µm, of which each round sets the next.
LENGTHS_UM = [6.0, 9.0]
# Largest relative difference of a picture, by rounding, between kernels that contain different other BSDFs.
ROUNDING = 1e-5


def bsdf(period_um):
    """Dictionary of a blazed grating in aluminium whose tables are quickly built."""
    quick = {"tolerance": 0.01, "conserve_energy": False}
    return {"type": "diffraction", "preset": "blazed", "material": "Al", "period": period_um, **quick}


def scene(period_um):
    """A square with the grating under a point light, seen in 4 × 4 pixels."""
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
            "plate": {"type": "rectangle", "bsdf": bsdf(period_um)},
        }
    )


def picture(scene, coherence_length_um):
    """Renders the scene after its grating was given a coherence length."""
    params = mi.traverse(scene.shapes()[0].bsdf())
    params["coherence_length"] = coherence_length_um
    params.update()
    return np.array(mi.render(scene, spp=1, seed=1))


def main(variant, rounds):
    """Compares pictures from three threads with those rendered before; returns whether any differs."""
    use_variant(variant)
    scenes = [scene(period_um) for period_um in PERIODS_UM]
    # Pictures by scene and coherence length.
    wanted = [[picture(one, length_um) for length_um in LENGTHS_UM] for one in scenes]
    failures = []

    def render(i, turn, kept):
        """Makes a BSDF, which `kept` holds until the end of the round, and renders scene i."""
        try:
            kept.append(mi.load_dict(bsdf(PERIODS_UM[i])))
            which = turn % len(LENGTHS_UM)
            np.testing.assert_allclose(picture(scenes[i], LENGTHS_UM[which]), wanted[i][which], rtol=ROUNDING)
        except Exception as error:
            failures.append(f"round {turn}: {error.__cause__ or error}")

    for turn in range(rounds):
        kept = []
        threads = [threading.Thread(target=render, args=(i, turn, kept)) for i in range(len(scenes))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        # Deletes the BSDFs of the round.
        del kept
        gc.collect()
    print(*failures, sep="\n")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2])))
