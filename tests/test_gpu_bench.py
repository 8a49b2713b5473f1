"""The checks and timings for a machine with a GPU: the dry run passes, and wrong results are rejected."""

import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from benches.gpu import agreement, checks, inspection, kernels, machine, questions, scenes, snake, supervisor, surfaces
from benches.gpu.parts import PARTS
from benches.gpu.plan import CARD, DRY_RUN
from benches.gpu.supervisor import Run
from docs.figures import card

REPOSITORY = Path(__file__).resolve().parent.parent
MODULES = [path.stem for path in (REPOSITORY / "benches" / "gpu").glob("[a-z]*.py")]


def bench(*words, **environment):
    return subprocess.run(
        [sys.executable, "-m", "benches.gpu", *map(str, words)],
        cwd=REPOSITORY,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=600,
    )


@pytest.fixture(scope="module")
def dry_run(tmp_path_factory):
    """Results of a dry run of all parts, most of this file's time."""
    folder = tmp_path_factory.mktemp("dry-run")
    file = folder / "gpu.json"
    done = bench("--dry-run", "--json", file, "--pictures", folder / "pictures")
    print(done.stdout, done.stderr)
    assert done.returncode in (0, 1), done.stderr
    results = json.loads(file.read_text(encoding="utf-8"))
    failed = [part["status"] != "passed" for part in results["parts"].values()]
    assert done.returncode == int(any(failed))
    return results


@pytest.mark.parametrize("name", PARTS)
def test_a_dry_run_passes(dry_run, name):
    part = dry_run["parts"][name]
    assert part["status"] == "passed", (part["error"], [row for row in part["rows"] if row.get("passed") is False])
    assert part["rows"]


def test_a_dry_run_describes_the_machine(dry_run):
    about = dry_run["machine"]
    assert about["card"] is None
    assert about["sunbeam"][0].isdigit()
    assert about["mitsuba"][0].isdigit()


def test_a_dry_run_compares_different_implementations(dry_run):
    """The reference is never LLVM itself, which would agree with any error."""
    for part in ("agree-rgb", "agree-spectral", "agree-polarized", "snake"):
        assert {row["reference"].split("_")[0] for row in dry_run["parts"][part]["rows"]} == {"scalar"}
    # There is no scalar variant without colours.
    assert {row["reference"] for row in dry_run["parts"]["agree-mono"]["rows"]} == {"llvm_ad_rgb"}


def test_pages_read_what_a_run_writes(dry_run, tmp_path):
    file = tmp_path / "gpu.json"
    file.write_text(json.dumps({**dry_run, "machine": {"card": "One", "driver": "1.2"}}))
    found = card.read(file)
    assert (found.name, found.driver) == ("One", "1.2")
    width, height = DRY_RUN.frame_sizes[0]
    made = [
        found.call_ns("rgb", "blazed", "eval"),
        found.render_ratio("rgb", DRY_RUN.scenes[0], "scan"),
        found.frame_ms("table", width, height),
        found.shading_us("table", width, height),
    ]
    assert all(value > 0 for value in made)
    # Shading is a part of a frame.
    assert made[2] > 1e-3 * made[3]
    assert card.measured(made[0]) != card.NOT_RUN


def test_missing_rows_are_shown_as_not_run(tmp_path):
    nothing = card.read(tmp_path / "missing.json")
    failed = card.Card("One", "1.2", {"renders": {"rows": [{"kind": "rgb", "scene": "disc", "passed": False}]}})
    for found in (nothing, failed):
        made = [
            found.call_ns("rgb", "blazed", "eval"),
            found.render_ratio("rgb", "disc", "cd"),
            found.frame_ms("table", 512, 512),
            found.shading_us("table", 512, 512),
        ]
        assert [card.measured(value) for value in made] == [card.NOT_RUN] * 4


@pytest.mark.parametrize(
    ("kind", "surface", "wrong"),
    [
        ("rgb", "blazed", {"rotation": 0.1}),
        ("spectral", "blazed", {"height": 0.25 * 0.999}),
        ("spectral_polarized", "perfect grating", {"coherence_length": 64.5}),
    ],
)
def test_another_surface_does_not_agree(kind, surface, wrong):
    found = agreement.agree(replace(DRY_RUN, scalar_questions=256), kind, surfaces.surface(surface), wrong)
    assert not found["passed"]


def answered(count=4096):
    """Random numbers in the shape of a BSDF's answers."""
    rng = np.random.default_rng(2)
    value, pdf = rng.random((4, count)), 0.1 + rng.random(count)
    wo = questions.directions(rng, count).astype(float)
    return questions.Answers(value, pdf, value, pdf, wo, pdf, value / pdf)


def judged(ours, theirs):
    comparable = agreement.comparison_for(agreement.Pair("cuda_ad_spectral", "llvm_ad_spectral"))
    return agreement.judged(agreement.errors_of(ours, theirs, theirs, comparable))


def test_equal_answers_agree():
    found = judged(answered(), answered())
    assert found["passed"]
    assert found["eval"]["max"] == found["stray"] == 0


@pytest.mark.parametrize("field", ["value", "pdf", "both_value", "both_pdf", "weight", "sampled_pdf", "sampled_wo"])
@pytest.mark.parametrize("wrong", ["off by 2e-4", "NaN"])
def test_wrong_answers_do_not_agree(field, wrong):
    true = answered()
    given = getattr(true, field).copy()
    # Ten of a thousand answers, ten times the accepted fraction.
    given[..., ::100] *= {"off by 2e-4": 1 + 2e-4 if field != "sampled_wo" else 1.01, "NaN": np.nan}[wrong]
    assert not judged(replace(true, **{field: given}), true)["passed"]


def test_zero_answers_do_not_agree():
    true = answered()
    nothing = replace(true, **{name: 0 * given for name, given in vars(true).items()})
    assert not judged(nothing, nothing)["passed"]


def pictures(seed, brightness=1.0, noise=0.05):
    rng = np.random.default_rng(seed)
    truth = np.random.default_rng(1).uniform(0.2, 1.0, (24, 32, 3))
    return brightness * truth * (1 + noise * rng.standard_normal((8, *truth.shape)))


def test_pictures_are_judged_by_their_noise():
    assert snake.judged(pictures(2), pictures(3))["passed"]
    # Without noise the tolerance is rounding alone.
    assert snake.judged(pictures(2, noise=0.0), pictures(3, noise=0.0))["passed"]
    assert not snake.judged(pictures(2, noise=0.0, brightness=1.01), pictures(3, noise=0.0))["passed"]
    # The standard error of the mean of 8 pictures of 768 numbers with 5 % of noise is 1e-3; rounding adds 1e-3.
    assert not snake.judged(pictures(2, brightness=1.02), pictures(3))["passed"]
    assert not snake.judged(pictures(2) * [1.05, 1.0, 0.95], pictures(3))["passed"]
    assert not snake.judged(pictures(2)[:, ::-1], pictures(3))["passed"]
    assert not snake.judged(pictures(2) * np.nan, pictures(3))["passed"]


def test_a_glint_in_one_picture_is_no_difference():
    glints, rng = pictures(2), np.random.default_rng(4)
    glints[rng.integers(8, size=200), rng.integers(24, size=200), rng.integers(32, size=200)] += 20.0
    assert snake.judged(glints, pictures(3))["exceeding"] <= snake.EXCEEDING


def test_nan_differs_from_everything():
    image = np.ones((4, 4, 3))
    assert scenes.differing(image, image) == 0
    assert scenes.differing(image * np.nan, image) == 1
    assert kernels.largest_error([np.ones(3)], [np.ones(3)]) == 0
    assert kernels.largest_error([np.array([1, np.nan, 1])], [np.ones(3)]) == np.inf


def test_the_cuda_compilers_report_is_read():
    # A log of `ptxas --verbose` with two kernels.
    log = """
    ptxas info    : Compiling entry function 'drjit_a' for 'sm_90'
    ptxas info    : Function properties for drjit_a
    ptxas         .     0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads
    ptxas info    : Used 40 registers, 4096 bytes cmem[0]
    ptxas info    : Function properties for drjit_b
    ptxas         .   128 bytes stack frame, 16 bytes spill stores, 24 bytes spill loads
    ptxas info    : Used 122 registers, 128 bytes cumulative stack size, 4096 bytes cmem[0]
    """
    expected = {"registers": 122, "stack_bytes": 128, "spill_store_bytes": 16, "spill_load_bytes": 24}
    assert inspection.reported(log) == expected
    assert set(inspection.reported("").values()) == {None}


def test_checks_continue_after_a_failure(tmp_path, capsys):
    def broken():
        raise RuntimeError("no\nsuch thing")

    def measured():
        return {"ns": np.float32(2.0), "count": np.int64(3), "passed": np.bool_(True)}

    given = [("one", broken), ("two", lambda: {"passed": True, "x": float("nan")}), ("three", measured)]
    assert not checks.run(given, tmp_path / "rows")
    rows = [json.loads(line) for line in (tmp_path / "rows").read_text(encoding="utf-8").splitlines()]
    assert [row["check"] for row in rows] == ["one", "two", "three"]
    assert rows[0]["error"] == "RuntimeError: no such thing"
    assert rows[1]["x"] == "nan"
    assert (rows[2]["ns"], rows[2]["count"], rows[2]["passed"]) == (2.0, 3, True)
    assert "FAILED one" in capsys.readouterr().out
    assert checks.run(given[1:], tmp_path / "rows")


def supervised(monkeypatch, tmp_path, code, seconds=60.0, limit=60):
    """Result of a part whose process runs `code`, where `rows` is the file of results."""
    name = next(iter(PARTS))
    monkeypatch.setitem(PARTS, name, replace(PARTS[name], limit_s=limit))
    child = "import json, os, signal, subprocess, sys, time\nrows = sys.argv[1]\n" + code
    monkeypatch.setattr(supervisor, "child", lambda name, run, rows: [sys.executable, "-c", child, str(rows)])
    return supervisor.run_all([name], Run((), tmp_path, time.monotonic() + seconds))[name]


ROW = "open(rows, 'a').write(json.dumps({'check': 'a', 'passed': True}) + '\\n')\n"


def test_rows_before_a_crash_are_kept(monkeypatch, tmp_path):
    found = supervised(monkeypatch, tmp_path, ROW + "os.kill(os.getpid(), signal.SIGSEGV)")
    assert (found["status"], found["error"]) == ("failed", "ended by SIGSEGV")
    assert [row["check"] for row in found["rows"]] == ["a"]


def test_a_hanging_part_is_killed_with_its_children(monkeypatch, tmp_path):
    left = tmp_path / "left"
    grandchild = f"import time, pathlib; time.sleep(3); pathlib.Path({str(left)!r}).touch()"
    code = ROW + f"subprocess.Popen([sys.executable, '-c', {grandchild!r}])\ntime.sleep(60)"
    found = supervised(monkeypatch, tmp_path, code, limit=1)
    assert (found["status"], found["error"]) == ("failed", "ended at its limit of 1 s")
    assert len(found["rows"]) == 1
    time.sleep(3.5)
    assert not left.exists()


def test_a_part_without_results_or_time_does_not_pass(monkeypatch, tmp_path):
    assert supervised(monkeypatch, tmp_path, "")["status"] == "failed"
    found = supervised(monkeypatch, tmp_path, "sys.exit('no module')")
    assert (found["status"], found["error"]) == ("failed", "no module")
    found = supervised(monkeypatch, tmp_path, ROW, seconds=1.0)
    assert (found["status"], found["error"]) == ("not run", "the time of the run was up")
    assert supervised(monkeypatch, tmp_path, ROW)["status"] == "passed"


def test_a_part_alone_gets_the_folder_of_data(monkeypatch, tmp_path):
    monkeypatch.delenv("SUNBEAM_DATA", raising=False)
    for name in ("calls", *supervisor.UNCACHED):
        folder = tmp_path / name
        folder.mkdir()
        assert supervisor.environment(name, folder, tmp_path)["SUNBEAM_DATA"] == str(tmp_path)
    assert "SUNBEAM_DATA" not in supervisor.environment("calls", tmp_path, None)
    assert "SUNBEAM_DATA" not in os.environ


def test_results_of_another_card_are_not_kept(tmp_path):
    file = tmp_path / "gpu.json"
    a, b = ({"status": "passed", "rows": [name]} for name in "ab")
    one, other, none = ({"card": card} for card in ("One", "Other", None))
    supervisor.write({"machine": one, "parts": {"calls": a}}, file)
    assert supervisor.gathered({"renders": b}, one, file)["parts"] == {"calls": a, "renders": b}
    assert supervisor.gathered({"renders": b}, other, file) == {"machine": other, "parts": {"renders": b}}
    # Pictures compared on a machine without a card belong to the card that drew them.
    assert supervisor.gathered({"pictures": b}, none, file) == {"machine": one, "parts": {"calls": a, "pictures": b}}


def test_a_card_without_its_variants_fails_and_says_why(tmp_path):
    """A fake `nvidia-smi` names a card without a driver."""
    smi = tmp_path / "nvidia-smi"
    smi.write_text("#!/bin/sh\necho 'NVIDIA Test, 580.1, 81559 MiB, 9.0'\n")
    smi.chmod(0o755)
    words = ("without-optix", "derivatives", "--json", tmp_path / "gpu.json", "--pictures", tmp_path / "pictures")
    done = bench(*words, PATH=f"{tmp_path}{os.pathsep}{os.environ['PATH']}", CUDA_VISIBLE_DEVICES="")
    assert done.returncode == 1, done.stderr
    results = json.loads((tmp_path / "gpu.json").read_text(encoding="utf-8"))
    assert results["machine"]["card"] == "NVIDIA Test"
    assert results["machine"]["driver"] == "580.1"
    assert {part["status"] for part in results["parts"].values()} == {"failed"}
    assert "cuda_ad_rgb does not run here" in results["parts"]["derivatives"]["rows"][0]["error"]
    assert "cuda_ad_rgb does not run here" in results["parts"]["without-optix"]["rows"][0]["render"]


@pytest.mark.parametrize(
    ("words", "said"), [(["no-such"], "unknown part 'no-such'"), (["--compare", "calls"], "pictures alone")]
)
def test_wrong_arguments_are_refused(words, said):
    done = bench(*words)
    assert done.returncode == 2
    assert said in done.stderr


def test_the_parts_fit_into_a_run():
    # Two runs fit into a quarter of an hour.
    assert sum(part.estimate_s for part in PARTS.values()) <= 480
    assert all(part.estimate_s < part.limit_s for part in PARTS.values())
    listed = bench("--list").stdout
    assert all(name in listed for name in PARTS)


def test_mitsuba_and_numpy_suffice(tmp_path):
    """The benchmark imports with Mitsuba and NumPy alone, as on rented machines."""
    for name in ("mitsuba", "drjit", "numpy"):
        package = Path(find_spec(name).origin).parent
        (tmp_path / name).symlink_to(package)
        # NumPy's shared libraries are in a folder beside it.
        for libraries in package.parent.glob(f"{name}.libs"):
            (tmp_path / libraries.name).symlink_to(libraries)
    imports = "\n".join(f"import benches.gpu.{name}" for name in (*MODULES, "__main__"))
    done = subprocess.run(
        # -S hides the installed packages.
        [sys.executable, "-S", "-c", imports],
        cwd=REPOSITORY,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


def test_the_plan_of_a_card_covers_the_variants_and_surfaces():
    assert CARD.questions == 1 << 20
    assert CARD.wavefront == 1 << 24
    for name in (*CARD.surfaces, *DRY_RUN.surfaces):
        assert surfaces.surface(name)


def test_a_machine_without_nvidia_smi_has_no_card(monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert machine.card() is None
