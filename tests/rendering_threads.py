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
# Largest relative difference of two pictures of a scene with the same coherence length. A kernel contains the code of
# all BSDFs that exist, so the compiler may round differently when others exist.
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
    """Compares pictures from three threads with those rendered before by one. Returns whether any differs or fails."""
    use_variant(variant)
    scenes = [scene(period_um) for period_um in PERIODS_UM]
    # Indexed by scene and coherence length.
    wanted = [[picture(one, length_um) for length_um in LENGTHS_UM] for one in scenes]
    failures = []

    def render(i, round_index, kept):
        """Makes a BSDF, which `kept` holds until the end of the round, and compares a new picture of scene i."""
        try:
            kept.append(mi.load_dict(bsdf(PERIODS_UM[i])))
            length_index = round_index % len(LENGTHS_UM)
            found = picture(scenes[i], LENGTHS_UM[length_index])
            np.testing.assert_allclose(found, wanted[i][length_index], rtol=ROUNDING)
        except Exception as error:
            failures.append(f"round {round_index}: {error.__cause__ or error}")

    for round_index in range(rounds):
        kept = []
        threads = [threading.Thread(target=render, args=(i, round_index, kept)) for i in range(len(scenes))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        # Deletes the BSDFs of the round while no thread renders.
        del kept
        gc.collect()
    print(*failures, sep="\n")
    return bool(failures)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2])))
