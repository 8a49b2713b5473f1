"""BSDFs can be made, changed or deleted while others are traced, and before their own kernels run."""

import gc
import subprocess
import sys
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from test_traced import COUNT, answers, as_numbers, assert_same, question

QUICK = {"preset": "blazed", "period": 2.0, "coherence_length": 6.0, "tolerance": 0.01, "conserve_energy": False}
ROUNDS = 20
# Timeout in seconds; all rounds take ten. Threads that corrupt Dr.Jit's state may deadlock.
PATIENCE_S = 180


@pytest.mark.parametrize("name", ["scalar_rgb", "llvm_ad_rgb"])
def test_threads_render_scenes_of_their_own(name):
    """The test runs in its own process, which a failure may crash."""
    script = Path(__file__).with_name("rendering_threads.py")
    words = [sys.executable, script, name, ROUNDS]
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_bsdf_deleted_while_it_is_traced_answers(traced):
    """Dr.Jit's pointers do not own BSDFs, so another thread may delete one at any time. A texture of the BSDF does."""
    si, wo, _ = question()
    held = []

    class Deleting(mi.Texture):
        def eval(self, si, active=True):
            held.clear()
            gc.collect()
            return mi.UnpolarizedSpectrum(1.5)

        def is_spatially_varying(self):
            return False

        def to_string(self):
            return "Deleting[]"

    mi.register_texture("deleting", Deleting)
    given = {**QUICK, "type": "diffraction", "obliquity": "stam"}
    wanted = mi.load_dict({**given, "eta": {"type": "rgb", "value": 1.5} if mi.is_rgb else 1.5})
    held.append(mi.load_dict({**given, "eta": {"type": "deleting"}}))
    pointers = dr.repeat(mi.BSDFPtr(held[0]), COUNT)
    found = as_numbers(pointers.eval_pdf(mi.BSDFContext(), si, wo))
    assert not held
    assert_same(found, as_numbers(wanted.eval_pdf(mi.BSDFContext(), si, wo)))


@pytest.mark.parametrize("pointers", [False, True])
@pytest.mark.parametrize("change", [{"coherence_length": 12.0}, {"eta.value": 1.2}, None], ids=str)
def test_pending_answers_use_the_tables_of_their_call(traced, change, pointers):
    asked = question()
    bsdf = mi.load_dict({"type": "diffraction", **QUICK, "eta": 1.56, "k": 0.3})
    ask = dr.repeat(mi.BSDFPtr(bsdf), COUNT) if pointers else bsdf
    wanted = as_numbers(answers(ask, *asked))
    pending = answers(ask, *asked)
    if change:
        params = mi.traverse(bsdf)
        params.update(change)
    else:
        del bsdf, ask
        gc.collect()
        # Another BSDF may take the deleted one's memory.
        mi.load_dict({"type": "diffraction", **QUICK, "preset": "sinusoidal"})
    assert_same(as_numbers(pending), wanted)
    if change:
        assert np.abs(as_numbers(answers(ask, *asked))[0] - wanted[0]).max() > 0.01 * wanted[0].max()
