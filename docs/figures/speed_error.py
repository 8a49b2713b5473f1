"""The part `speed-error`: time and error of every method by `sunbeam bench`, on presets and a scan."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from mitsuba_scenes.crosscheck.cases import SCAN
from mitsuba_scenes.tool import sunbeam

from .page import images

PART = "speed-error"
# Limits of ΔE2000 for which the fastest settings are listed; an eye just notices 1.
DELTA_E_LIMITS = (10.0, 3.0, 1.0, 0.5, 0.1, 0.01)


def figures(scan: Path = SCAN, *words: str) -> dict:
    """Runs the benchmark on the presets, and on the scan if present."""
    folder = images(PART)
    report = measured("--plot", folder / "presets.svg", *words)
    surfaces = report["surfaces"]
    if scan.exists():
        beside = measured("--plot", folder / "scan.svg", "--height-field", scan, *words)
        surfaces += [{**surface, "name": f"scan of {surface['name']}"} for surface in beside["surfaces"]]
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


def measured(*words) -> dict:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.json"
        sunbeam("bench", "--json", file, *words)
        return json.loads(file.read_text())


def surface_figures(surface: dict) -> dict:
    """The entries of one surface, with labels, selections and fastest settings."""
    entries = [entry_figures(entry) for entry in surface["entries"]]
    return {
        "name": surface["name"],
        "pixels": surface["pixels"],
        "extent_um": surface["extent_um"],
        "kappa_h": round(surface["kappa_h"], 2),
        "oracle": surface["oracle"],
        "defaults": [entry for entry in entries if entry["is_default"]],
        "off_front": [entry["label"] for entry in entries if entry["is_default"] and not entry["on_front_of_method"]],
        "choices": [
            {"delta_e": limit, "any": fastest(entries, limit), "flss": fastest(of(entries, "flss"), limit)}
            for limit in DELTA_E_LIMITS
        ],
        "steps": [e for e in of(entries, "flss") if e["group"] == default_group(entries, "flss")],
        "taylor": [e for e in of(entries, "flss") if e["parameters"]["series"] == "taylor"],
        "orders": [
            e for e in of(entries, "flss") if e["parameters"]["lambda_step_nm"] == 5 and "chebyshev" in e["group"]
        ],
        "others": [entry for entry in entries if entry["method"] in ("nmm", "pq", "stam")],
        "tables": of(entries, "colour-table"),
        "spectral": of(entries, "spectral-table"),
    }


def entry_figures(entry: dict) -> dict:
    """The page's figures of one measured method with its options; times are per evaluation."""
    gpu = entry.get("gpu")
    parameters = entry["parameters"]
    return {
        "method": entry["method"],
        "model": entry["model"],
        "parameters": parameters,
        "label": label(entry),
        # Equal for entries that differ in the wavelength step alone.
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
    """The method and its parameters as text."""
    words = []
    for name, value in entry["parameters"].items():
        if name == "lambda_step_nm":
            words.append(f"{value:g} nm")
        elif name == "terms":
            words.append(f"{value} terms")
        elif name == "neighbourhood":
            words.append(f"{value}×{value} orders")
        elif name == "series":
            words.append(value.capitalize())
        elif name == "weighted":
            words.append("weighted" if value else "unweighted")
        elif name == "tolerance":
            words.append(f"tolerance {value:g}")
        elif name == "resolution":
            words.append(f"resolution {value:g}")
        else:
            words.append(f"{name} {value}")
    model = " (patch)" if entry["model"] == "patch" and "table" in entry["method"] else ""
    return f"{entry['method']}{model}" + (": " + ", ".join(words) if words else "")


def rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.3g}")


def of(entries: list[dict], method: str) -> list[dict]:
    return [entry for entry in entries if entry["method"] == method]


def default_group(entries: list[dict], method: str) -> list[str]:
    return next(entry["group"] for entry in of(entries, method) if entry["is_default"])


def fastest(entries: list[dict], limit: float) -> dict | None:
    """The fastest entry on the CPU that keeps 99 % of the directions within the limit."""
    good = [entry for entry in entries if entry["delta_e_p99"] <= limit]
    return min(good, key=lambda entry: entry["cpu_us"], default=None)


def processor() -> str:
    """The model of the CPU, as far as the system names it."""
    file = Path("/proc/cpuinfo")
    lines = file.read_text().splitlines() if file.exists() else []
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown CPU")
