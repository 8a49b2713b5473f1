"""The part `skins-validity`: the model on measured skins against Maxwell's equations.

A crop of a scan, repeated as a tile, is solved by the independent solver of tests/judges/crossed (the *judge*). A
*form* is the model with one choice of obliquity factor, energy conservation and shadowing (docs/model.md). *Misplaced*
power is the fraction of the power in wrong orders.
"""

from __future__ import annotations

import json

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import mitsuba as mi
import numpy as np

from mitsuba_scenes.environment import use_variant
from mitsuba_scenes.skin import preset_skin
from mitsuba_scenes.tool import sunbeam
from tests.judges.crossed.cases import ANSWERS, BASE, KERATIN, VARIED, WAVELENGTHS_NM, Answer, Case, answers
from tests.judges.crossed.crops import scanned
from tests.judges.crossed.judged import SKINS as RESOLUTION
from tests.judges.crossed.judged import relief_of
from tests.judges.crossed.model import (
    FORMS,
    SMALL_SLOPE,
    SMALL_SLOPE_LIMITED,
    STAM,
    Form,
    Light,
    efficiencies,
    misplaced,
)
from tests.judges.crossed.relief import Relief, synthetic
from tests.judges.crossed.solver import Resolution, solve

from .bsdf_calls import CALLS, RELIEFS, VARIANTS, call_ns
from .page import images, insist
from .skin_scans import SKINS, scans_present

PART = "skins-validity"
# Largest angle of incidence that is not counted as grazing.
REACH_DEG = 60.0
plt.rcParams.update({"svg.fonttype": "none", "font.size": 9, "svg.hashsalt": "sunbeam"})
# Largest accepted ratio of the time of a call with `small_slope` to one with `stam`.
COST_MAX = 1.15
COLOURS = dict(zip((form.name for form in FORMS), ("k", "tab:blue", "tab:cyan", "tab:orange", "tab:red")))


def found(relief: Relief, case: Case, form: Form, judge: list[Answer]) -> list[float]:
    """Misplaced power of a form of the model for each light of the judge's answers."""
    lights = [(answer.light, answer.jx, answer.jy) for answer in judge]
    powers = efficiencies(relief, complex(case.eta), form, lights)
    return [misplaced(power, answer.unpolarised) for power, answer in zip(powers, judge)]


def spread(values: list[float], judge: list[Answer], near: bool) -> dict:
    """Mean and largest value over the lights up to REACH_DEG, or beyond it."""
    chosen = [v for v, answer in zip(values, judge) if (answer.light.theta_deg <= REACH_DEG) == near]
    return {"mean": float(np.mean(chosen)), "worst": float(max(chosen))}


def row(case: Case, relief: Relief, judge: list[Answer], forms: tuple[Form, ...]) -> dict:
    """A crop's properties, and the errors of each form of the model on it."""
    by_form = {form.name: found(relief, case, form, judge) for form in forms}
    flat = [fresnel(case.eta, answer.light.theta_deg) for answer in judge]
    return {
        "skin": case.crop.skin,
        "crop": case.crop.name,
        "smoothing": case.smoothing,
        "factor": case.factor,
        "eta": case.eta,
        "period_um": list(relief.period),
        "rms_slopes": list(relief.rms_slopes()),
        "peak_to_valley_um": float(np.ptp(relief.sampled(201, 201).heights)),
        "lights": len(judge),
        "near": {name: spread(values, judge, True) for name, values in by_form.items()},
        "grazing": {name: spread(values, judge, False) for name, values in by_form.items()},
        "of_flat": float(
            np.mean([a.unpolarised.sum() / r for a, r in zip(judge, flat) if a.light.theta_deg <= REACH_DEG])
        ),
        "balance": max(answer.balance for answer in judge),
        "residual": max(answer.residual for answer in judge),
        "by_light": {name: [float(v) for v in values] for name, values in by_form.items()},
    }


def fresnel(eta: float, theta_deg: float) -> float:
    """Reflectance of a flat dielectric for unpolarised light."""
    cos = np.cos(np.radians(theta_deg))
    inside = np.sqrt(eta**2 - 1 + cos**2)
    s, p = (cos - inside) / (cos + inside), (eta**2 * cos - inside) / (eta**2 * cos + inside)
    return float(0.5 * (s**2 + p**2))


def over(rows: list[dict], judged: dict, skin: str, form: Form, key) -> dict:
    """Mean misplaced power over a skin's crops, grouped by `key` of the light."""
    groups: dict = {}
    for made in rows:
        if made["skin"] == skin:
            for answer, value in zip(judged[made["key"]], made["by_light"][form.name]):
                groups.setdefault(key(answer.light), []).append(value)
    return {float(at): float(np.mean(values)) for at, values in sorted(groups.items())}


def checks() -> dict:
    """Largest differences of an order's power between the solver and independent results."""
    # A relief along x alone, against the boundary integral of `sunbeam orders`.
    x = np.arange(33) / 33
    wave = Relief(0.1 * (1 + np.sin(2 * np.pi * x))[None], (1.3, 0.3))
    apart = 0.0
    for theta, phi in ((20.0, 0.0), (60.0, 35.0)):
        own = solve(wave, 550.0, theta, phi, KERATIN, Resolution(9.0, 12))
        words = ("--preset", "sinusoidal", "--period", 1.3, "--height", 0.2, "--eta", KERATIN, "--theory", "rigorous")
        told = json.loads(sunbeam("orders", *words, "--theta-i", theta, "--phi-i", phi, "--json"))
        other = {order["order"]: order["mean"] for order in told["orders"]}
        apart = max(apart, *(abs(v - other[j]) for j, v in zip(own.jx, own.unpolarised)))
    # Reciprocity: light returned along its strongest other order.
    relief, light = synthetic(), Light(550.0, 40.0, 35.0)
    there = solve(relief, 550.0, light.theta_deg, light.phi_deg, KERATIN)
    strongest = int(np.argmax(there.unpolarised * ((there.jx != 0) | (there.jy != 0))))
    order = np.array([there.jx[strongest], there.jy[strongest]])
    wo = 0.55 * order / np.array(relief.period) - light.wi[:2]
    theta, phi = np.degrees([np.arcsin(np.hypot(*wo)), np.arctan2(wo[1], wo[0])])
    back = solve(relief, 550.0, float(theta), float(phi), KERATIN)
    again = (back.jx == order[0]) & (back.jy == order[1])
    returned = abs(back.unpolarised[again][0] - there.unpolarised[strongest])
    return {"one_dimension": float(apart), "reciprocity": float(returned)}


def cost() -> list[dict]:
    """Time of BSDF calls with `small_slope` relative to `stam`, in keratin."""
    rows = []
    for variant in VARIANTS:
        use_variant(variant, fall_back=False)
        for relief in RELIEFS:
            bsdf = {"type": "diffraction", **preset_skin(relief), "eta": KERATIN}
            bsdfs = {form: mi.load_dict({**bsdf, "obliquity": form}) for form in ("stam", "small_slope")}
            ns = {call: call_ns(bsdfs, call) for call in CALLS}
            ratios = {call: float(ns[call]["small_slope"] / ns[call]["stam"]) for call in CALLS}
            rows.append({"variant": variant, "relief": relief, "ratios": ratios})
    # The mean, since single ratios are noisy.
    insist(PART, np.mean([list(row["ratios"].values()) for row in rows]) <= COST_MAX, "small_slope costs about as much")
    return rows


def figures() -> dict | None:
    """All numbers of the part, or `None` without the scans; writes its plot."""
    if not scans_present():
        return None
    judged = answers("skins")
    scans = {skin: scanned(skin) for skin in SKINS}
    rows, varied = [], []
    for case in BASE:
        if case.crop.name == "A":
            bare, limited = (
                found(relief_of(case, scans), case, form, judged[case.key])
                for form in (SMALL_SLOPE, SMALL_SLOPE_LIMITED)
            )
            insist(PART, np.allclose(bare, limited, rtol=1e-6), "limiting small_slope changes nothing")
        rows.append({"key": case.key, **row(case, relief_of(case, scans), judged[case.key], FORMS)})
    for case in VARIED:
        varied.append(row(case, relief_of(case, scans), judged[case.key], (SMALL_SLOPE, STAM)))
    skins = []
    for skin in SKINS:
        mine = [made for made in rows if made["skin"] == skin]
        near, grazing = (
            {
                form.name: {
                    "mean": float(np.mean([made[reach][form.name]["mean"] for made in mine])),
                    "worst": max(made[reach][form.name]["worst"] for made in mine),
                }
                for form in FORMS
            }
            for reach in ("near", "grazing")
        )
        by_angle = {form.name: over(rows, judged, skin, form, lambda light: light.theta_deg) for form in FORMS}
        by_nm = {form.name: over(rows, judged, skin, form, lambda light: light.wavelength_nm) for form in FORMS}
        skins.append({"skin": skin, "near": near, "grazing": grazing, "by_angle": by_angle, "by_wavelength": by_nm})
        insist(PART, near[SMALL_SLOPE.name]["mean"] < near[STAM.name]["mean"], f"small_slope is the better on {skin}")
    gains = {made["skin"]: made["near"][STAM.name]["mean"] / made["near"][SMALL_SLOPE.name]["mean"] for made in skins}
    insist(PART, gains["elaphe"] > 2 > 1.2 > gains["xenopeltis"], "the gain is on the gentler skin")
    draw(images(PART) / "angles.svg", skins)
    for made in (*rows, *varied):
        del made["by_light"]
    return {
        "forms": [form.name for form in FORMS],
        "wavelengths_nm": list(WAVELENGTHS_NM),
        "reach_deg": REACH_DEG,
        "cutoff_per_um": RESOLUTION.cutoff_per_um,
        "nodes": RESOLUTION.nodes,
        "rows": rows,
        "varied": varied,
        "skins": skins,
        "convergence": json.loads((ANSWERS / "convergence.json").read_text(encoding="utf-8")),
        "checks": checks(),
        "calls": list(CALLS),
        "cost": cost(),
    }


def draw(path, skins: list[dict]) -> None:
    """Draws misplaced power against the angle of incidence, means over crops, wavelengths and azimuths."""
    figure, axes = plt.subplots(1, len(skins), figsize=(9, 3.6), sharey=True)
    for ax, made in zip(axes, skins):
        for name, colour in COLOURS.items():
            values = made["by_angle"][name]
            at = [float(angle) for angle in values]
            ax.plot(at, [100 * value for value in values.values()], marker="o", ms=3, lw=1.3, label=name, color=colour)
        ax.set(title=f"scan of {made['skin']}", xlabel="θi in degrees", xticks=(0, 30, 60, 75), ylim=(0, None))
    axes[0].set_ylabel("misplaced power in %")
    axes[0].legend(fontsize=8, frameon=False)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
