"""Part `speed-error` of the documentation (page.py): time and error of every method, on presets and a scan.

`sunbeam bench` measures the methods of docs/realtime.md, such as FLSS, NMM and PQ. An *entry* is a method with its
options, measured on a surface. An entry has errors over directions: the mean and the 99th percentile of ΔE2000, the
colour difference CIEDE2000, and root mean square errors (RMSE) of spectra, RGB and XYZ.

An entry is *on the front*, the Pareto front of CPU time and ΔE2000, if no other entry is clearly better in one and at
least as good in the other (crates/cli/src/benchmarks/methods/pareto.rs). A second front compares only entries of one
method, also by the RMSE of the spectrum.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from mitsuba_scenes.crosscheck.cases import SCAN
from mitsuba_scenes.tool import sunbeam

from .page import images

PART = "speed-error"
# Limits of ΔE2000 for which the fastest entries are listed; an eye just notices 1.
DELTA_E_LIMITS = (10.0, 3.0, 1.0, 0.5, 0.1, 0.01)
# Texts of an entry's options in its label, by the option's name, for `str.format`.
PARAMETERS = {
    "lambda_step_nm": "{:g} nm",
    "terms": "{} terms",
    "neighbourhood": "{0}×{0} orders",
    "tolerance": "tolerance {:g}",
    "resolution": "resolution {:g}",
}


def figures(scan: Path = SCAN, *arguments: str) -> dict:
    """All numbers of the part, from runs on the presets and on the scan if present; draws a plot of each run.

    `arguments` are further ones of `sunbeam bench`.

    - `adapter`, `no_adapter`: the GPU, or the reason why none is measured.
    - `effort`: settings of the run, such as its number of directions.
    - `incident_deg`: the angle of incidence θ and the azimuth φ of each light.
    - `seconds`: the time of the run on the presets.
    """
    folder = images(PART)
    report = measured("--plot", folder / "presets.svg", *arguments)
    surfaces = report["surfaces"]
    if scan.exists():
        of_scan = measured("--plot", folder / "scan.svg", "--height-field", scan, *arguments)
        surfaces += [{**surface, "name": f"scan of {surface['name']}"} for surface in of_scan["surfaces"]]
    return {
        "cpu": processor(),
        "adapter": report.get("adapter"),
        "no_adapter": report.get("no_adapter"),
        "effort": report["effort"],
        "incident_deg": report["incident_deg"],
        "seconds": round(report["seconds"]),
        "has_scan": scan.exists(),
        "surfaces": [surface_figures(surface) for surface in surfaces],
    }


def measured(*arguments) -> dict:
    """The report of `sunbeam bench` with these `arguments`."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.json"
        sunbeam("bench", "--json", file, *arguments)
        return json.loads(file.read_text())


def surface_figures(surface: dict) -> dict:
    """A surface's properties, and selections of its entries for the page's tables.

    - `kappa_h`: κH, the largest phase in radians about the middle of the heights' range, at 380 nm and normal
      incidence and reflection.
    - `oracle`: errors of the benchmark's reference against the oracle, the direct sum in double precision.
    - `defaults`: each method with its default options. `off_front` has the labels of those not on their method's front.
    - `choices`: for each of DELTA_E_LIMITS the fastest entry of any method, and the fastest of FLSS.
    - `steps`: FLSS with its default options, at every measured step between wavelengths.
    - `taylor`: FLSS with Taylor's series.
    - `orders`: FLSS with Chebyshev's series in steps of 5 nm, with all numbers of orders and terms and all tolerances.
    - `others`: the methods NMM, PQ and Stam.
    - `tables`: the tables of colours.
    - `spectral`: the tables of spectra.
    """
    entries = [entry_figures(entry) for entry in surface["entries"]]
    flss = of_method(entries, "flss")
    # Identifies the default options, apart from the step between wavelengths (`entry_figures`).
    default_group = next(entry["group"] for entry in flss if entry["is_default"])
    return {
        "name": surface["name"],
        "pixels": surface["pixels"],
        "extent_um": surface["extent_um"],
        "kappa_h": round(surface["kappa_h"], 2),
        "oracle": surface["oracle"],
        "defaults": [entry for entry in entries if entry["is_default"]],
        "off_front": [entry["label"] for entry in entries if entry["is_default"] and not entry["on_front_of_method"]],
        "choices": [
            {"delta_e": limit, "any": fastest(entries, limit), "flss": fastest(flss, limit)} for limit in DELTA_E_LIMITS
        ],
        "steps": [entry for entry in flss if entry["group"] == default_group],
        "taylor": [entry for entry in flss if entry["parameters"]["series"] == "taylor"],
        "orders": [
            entry
            for entry in flss
            if entry["parameters"]["lambda_step_nm"] == 5 and entry["parameters"]["series"] == "chebyshev"
        ],
        "others": [entry for entry in entries if entry["method"] in ("nmm", "pq", "stam")],
        "tables": of_method(entries, "colour-table"),
        "spectral": of_method(entries, "spectral-table"),
    }


def entry_figures(entry: dict) -> dict:
    """The page's numbers of one entry, rounded.

    - `model`: the coherence model, `patch` or `ensemble` (docs/model.md#coherence).
    - `group`: identifies all options but the step between wavelengths.
    - `mb`, `build_s`: size in megabytes and build time in seconds of the method's data.
    - `cpu_us`, `gpu_us`: the time of an evaluation, a median over repetitions. `gpu_least_us` is the smallest time.
      Times on the GPU are `None` without an adapter and for tables of spectra.
    - `cpu_ratio`: the CPU time over that of FLSS with its default options.
    - Errors have the names of the report: `delta_e_mean`, `delta_e_p99`, `spectral_rmse`, `rgb_rmse`, `xyz_rmse`.
    """
    gpu = entry.get("gpu")
    parameters = entry["parameters"]
    return {
        "method": entry["method"],
        "model": entry["model"],
        "parameters": parameters,
        "label": label(entry),
        "group": [str(value) for name, value in sorted(parameters.items()) if name != "lambda_step_nm"],
        "is_default": entry["is_default"],
        "mb": rounded(entry["bytes"] / 1e6),
        "build_s": rounded(entry["build_seconds"]),
        "cpu_us": rounded(entry["cpu"]["microseconds"]),
        "cpu_ratio": rounded(entry["cpu"]["ratio"]),
        "gpu_us": rounded(gpu["microseconds"]) if gpu else None,
        "gpu_least_us": rounded(gpu["least_us"]) if gpu else None,
        **{name: rounded(value) for name, value in entry["errors"].items()},
        "on_front": entry["on_front"],
        "on_front_of_method": entry["on_front_of_method"],
    }


def label(entry: dict) -> str:
    """The method and its options as text, such as "flss: 5 nm, 1×1 orders, Chebyshev, 12 terms"."""
    texts = []
    for name, value in entry["parameters"].items():
        if name == "series":
            texts.append(value.capitalize())
        elif name == "weighted":
            texts.append("weighted" if value else "unweighted")
        else:
            texts.append(PARAMETERS.get(name, f"{name} {{}}").format(value))
    # Tables exist for both coherence models; only `patch` is named. The other methods exist for `patch` alone.
    model = " (patch)" if entry["model"] == "patch" and "table" in entry["method"] else ""
    return f"{entry['method']}{model}" + (": " + ", ".join(texts) if texts else "")


def rounded(value: float | None) -> float | None:
    """The value with three significant digits; `None` stays."""
    return None if value is None else float(f"{value:.3g}")


def of_method(entries: list[dict], method: str) -> list[dict]:
    """The entries of one method."""
    return [entry for entry in entries if entry["method"] == method]


def fastest(entries: list[dict], limit: float) -> dict | None:
    """The fastest entry on the CPU with a ΔE2000 of at most `limit` in 99 % of the directions; `None` without one.

    Times and errors are rounded (`entry_figures`), so the first of two entries with equal rounded times is taken.
    """
    accurate = [entry for entry in entries if entry["delta_e_p99"] <= limit]
    return min(accurate, key=lambda entry: entry["cpu_us"], default=None)


def processor() -> str:
    """The CPU's model from /proc/cpuinfo, or "unknown CPU"."""
    file = Path("/proc/cpuinfo")
    lines = file.read_text().splitlines() if file.exists() else []
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown CPU")
