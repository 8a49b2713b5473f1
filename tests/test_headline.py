"""The benchmark's arithmetic on known numbers, and its smallest cell on the plugin."""

from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest
from conftest import use_variant

from docs.figures import bsdf_calls, headline, rgb_against_spectral, sizes_and_covers, time_to_error
from docs.figures.benchmark_scenes import REFERENCE, scenes

NOISE = 0.1
# Four standard errors, 1/√(2n) each, of an error from n = 30,720 values.
ERROR_TOLERANCE = 4 / np.sqrt(2 * 30_720)
# Tolerance of mean noise in L*a*b* from 12,288 pixels, by an approximation for small deviations.
DELTA_E_TOLERANCE = 0.1


def pictures(count, noise=NOISE, size=(64, 80), seed=1):
    """Independent pictures of varying brightness with proportional noise."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(0.5, 2.0, (*size, 3))
    return truth * (1 + noise * rng.standard_normal((count, *size, 3)))


@pytest.mark.parametrize("count", [2, 8])
def test_noise_is_measured_without_a_reference(count):
    found = time_to_error.noise(pictures(count))["error"]
    # Without correction, the mean of two pictures as reference would give 0.7 of the noise, that of eight 0.94.
    assert found == pytest.approx(NOISE, rel=ERROR_TOLERANCE)


def test_noise_is_measured_by_channel():
    still, noisy = pictures(8, noise=0.0), pictures(8)
    found = time_to_error.noise(np.concatenate([noisy[..., :1], still[..., 1:]], axis=-1))
    # Red alone has a third of the values.
    assert found["channel_errors"] == pytest.approx([NOISE, 0, 0], rel=2 * ERROR_TOLERANCE, abs=1e-12)
    assert found["error"] == pytest.approx(NOISE / np.sqrt(3), rel=2 * ERROR_TOLERANCE)


def test_standard_error_matches_the_spread_of_errors():
    found = [time_to_error.noise(pictures(6, size=(8, 12), seed=seed)) for seed in range(200)]
    spread = np.std([each["error"] for each in found])
    # A standard error from six values is uncertain by a third; the mean of 200 is not.
    assert np.mean([each["error_std"] for each in found]) == pytest.approx(spread, rel=0.25)


def test_errors_of_dark_pixels_are_relative_to_the_mean():
    truth = np.full((4, 4, 3), 1.0)
    truth[0] = 1e-6
    image = truth.copy()
    image[0] += 0.01
    floor = time_to_error.FLOOR * truth.mean()
    found = time_to_error.relative_error(image, truth, np.ones((4, 4), bool))
    assert found == pytest.approx(0.01 / floor / 2)


def test_a_quarter_of_the_error_takes_sixteen_times_as_long():
    assert time_to_error.seconds_to_error(3.0, 0.2, aim=0.05) == pytest.approx(48.0)
    assert time_to_error.seconds_to_error(3.0, 0.05, aim=0.05) == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("fixed_s", "us_per_pixel", "expected"),
    [(0, 1, (192, 128)), (0, 100, (48, 32)), (0, 1e5, (24, 16)), (0.05, 1, (192, 128)), (0.05, 40, (48, 32))],
)
def test_slow_materials_get_small_pictures(fixed_s, us_per_pixel, expected):
    tried = []

    def seconds_of(size):
        tried.append(size)
        return fixed_s + 1e-6 * us_per_pixel * size[0] * size[1]

    assert time_to_error.fitting_size(seconds_of, limit_s=0.4) == expected
    assert tried[-1] == expected
    # Only the smallest size may take longer than the limit.
    assert all(size == time_to_error.SIZES[0] or seconds_of(size) <= 0.4 for size in list(tried))


def test_ratios_are_within_a_round_and_per_pixel():
    # The machine slows down by round. The diffraction takes three times as long a pixel, on a quarter of the pixels.
    slowness = np.array([1, 1.5, 2, 4, 9.0])
    small, large = pictures(5, size=(4, 6)), pictures(5, size=(8, 12))
    found = time_to_error.material_rows(
        {
            "x": [time_to_error.Render(image, 3 * slow, 6.0) for image, slow in zip(small, slowness)],
            REFERENCE: [time_to_error.Render(image, 4 * slow, 8.0) for image, slow in zip(large, slowness)],
        },
        {"x": small, REFERENCE: pictures(5, noise=NOISE / 2, size=(4, 6))},
    )
    assert [way["name"] for way in found] == ["x", REFERENCE]
    assert [way["time_ratio"]["median"] for way in found] == pytest.approx([3.0, 1.0])
    assert [way["cpu_ratio"]["median"] for way in found] == pytest.approx([3.0, 1.0])
    assert found[0]["seconds"] == pytest.approx(6.0 * time_to_error.NOMINAL_PIXELS / 24)
    expected = 3 * (found[0]["error"] / found[1]["error"]) ** 2
    assert found[0]["error_time_ratio"] == pytest.approx(expected)
    # Twice the noise; there are few pixels.
    assert found[0]["error_time_ratio"] == pytest.approx(12, rel=0.3)


def test_the_time_of_the_empty_kernel_is_subtracted():
    assert bsdf_calls.per_element_ns(3e-3, 1e-3, 1000) == pytest.approx(2000)
    assert 0 < bsdf_calls.per_element_ns(1e-3, 1.1e-3, 1000) < 1
    assert bsdf_calls.fitting_elements(bsdf_calls.KERNEL_S / 4096) == 4096
    assert bsdf_calls.fitting_elements(1.0) == bsdf_calls.FEWEST
    assert bsdf_calls.fitting_elements(0.0) == bsdf_calls.MOST


def test_lab_matches_published_values():
    # sRGB's primaries in L*a*b* under D65, to two decimals.
    colours = np.array([[1.0, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]])
    expected = [[100, 0, 0], [53.24, 80.09, 67.20], [87.74, -86.18, 83.18], [32.30, 79.19, -107.86], [0, 0, 0]]
    assert rgb_against_spectral.lab(colours) == pytest.approx(np.array(expected), abs=0.01)
    assert rgb_against_spectral.delta_e76(colours[0], colours[4]) == pytest.approx(100)


def test_difference_is_zero_for_equal_pictures_alone():
    picture = pictures(1)[0]
    halves = np.array([picture, picture])
    found = rgb_against_spectral.difference(halves, halves)
    assert (found["delta_e_mean"], found["noise_delta_e_mean"]) == (0, 0)
    assert (found["energy_ratio"], found["channel_ratios"]) == (1, [1, 1, 1])
    found = rgb_against_spectral.difference(1.1 * halves, halves)
    assert found["energy_ratio"] == pytest.approx(1.1)
    assert found["channel_ratios"] == pytest.approx([1.1] * 3)
    assert found["noise_delta_e_mean"] == 0
    assert 0 < found["delta_e_mean"] < found["delta_e_p95"]


def test_noise_is_distinguished_from_a_difference():
    truth = np.random.default_rng(3).uniform(0.5, 2.0, (96, 128, 3))

    def halves(seed):
        return truth * (1 + 0.03 * np.random.default_rng(seed).standard_normal((2, *truth.shape)))

    same = rgb_against_spectral.difference(halves(1), halves(2))
    assert same["delta_e_mean"] == pytest.approx(same["noise_delta_e_mean"], rel=DELTA_E_TOLERANCE)
    other = rgb_against_spectral.difference(halves(1) * [1.2, 1, 1], halves(2))
    assert other["delta_e_mean"] > 2 * other["noise_delta_e_mean"]


def test_noise_is_left_out_of_the_rms():
    rng = np.random.default_rng(5)
    spectral = rng.uniform(0.5, 2.0, (12_288, 3))
    rgb = spectral * [1.03, 1, 1]
    exact = rgb_against_spectral.difference(np.array([rgb] * 2), np.array([spectral] * 2))["delta_e_rms"]
    noisy = [truth * (1 + 0.03 * rng.standard_normal((2, *truth.shape))) for truth in (rgb, spectral)]
    found = rgb_against_spectral.difference(*noisy)
    # Four standard errors of 3.3 %, by 12,288 products of 3.6 times the noise, and 2 % for the curvature of L*a*b*.
    assert found["delta_e_rms"] == pytest.approx(exact, rel=0.15)
    assert found["delta_e_mean"] > 1.5 * exact


@pytest.mark.parametrize("variant", ["scalar_spectral", "llvm_ad_spectral"])
def test_a_cell_has_the_least_number_of_rounds(variant):
    use_variant(variant)
    cell = time_to_error.measure(scenes()[0], variant, budget_s=0.0)
    assert cell["rounds"] == time_to_error.ROUNDS_MIN
    assert [way["name"] for way in cell["ways"]] == ["blazed", "xenopeltis", REFERENCE]
    for way in cell["ways"]:
        assert tuple(way["size"]) == time_to_error.SIZES[0]
        assert 0 < way["error"] < 10
        assert way["seconds"] > 0


@pytest.mark.parametrize("name", ["snake", "disc", "scan"])
def test_scenes_are_not_black(name):
    use_variant("scalar_spectral")
    scene = next(scene for scene in scenes() if scene.name == name)
    bsdf = bsdf_of(scene)
    image = time_to_error.render(scene.load(bsdf, (24, 16), spp=4), seed=0).image
    assert np.all(np.isfinite(image))
    assert image.mean() > 1e-3


def bsdf_of(scene):
    """Mitsuba's material of a scene in the selected variant."""
    return mi.load_dict(scene.bsdfs()[REFERENCE])


def test_calls_take_time():
    use_variant("llvm_ad_rgb")
    bsdf = bsdf_of(scenes()[0])
    assert bsdf_calls.call_ns({"it": bsdf}, "sample")["it"] > bsdf_calls.per_element_ns(0, 0, 1)


def test_cpu_time_of_a_call_is_nanoseconds():
    use_variant("llvm_ad_rgb")
    bsdf = bsdf_of(scenes()[0])
    found = sizes_and_covers.cpu_ns({"it": bsdf}, "sample", repeats=3)["it"]
    # About 20 ns on 2 threads; a factor of 20 or more for other and busy machines.
    assert 1 < found < 1000


def test_pixels_of_the_near_ball_are_found():
    use_variant("llvm_ad_rgb")
    ball = replace(scenes()[0], build=sizes_and_covers.near_ball)
    seen = sizes_and_covers.sees_ball(ball.load(bsdf_of(ball), sizes_and_covers.SIZE, spp=1))
    # The ball is as wide as the picture, and higher.
    assert seen.shape == (8, 12)
    assert seen[2:4].all()
    assert not seen[-1, [0, -1]].any()
    assert seen.mean() > 0.75


def test_the_report_has_a_line_for_each_figure():
    way = {"name": REFERENCE, "seconds": 1.0, "time_ratio": {"median": 1.0}, "cpu_ratio": {"median": 1.0}, "error": 0.1}
    cell = {"scene": "sphere", "variant": "scalar_rgb", "rounds": 3}
    made = {
        "nominal_pixels": 65_536,
        "aim": 0.05,
        "cells": [{**cell, "ways": [{**way, "seconds_to_error": 4.0, "error_time_ratio": 1.0}]}],
        "calls": [{"variant": "llvm_ad_rgb", "name": "blazed", "ns": dict.fromkeys(bsdf_calls.CALLS, 12.5)}],
        "first_renders": [
            {"variant": "llvm_ad_rgb", "name": "blazed", "load_s": 0.1, "render_s": 2.25, "process_s": 3.0}
        ],
        "colours": [
            {
                "scene": "disc",
                "material": "gold",
                "delta_e_mean": 1.5,
                "delta_e_p95": 3.0,
                "noise_delta_e_mean": 0.2,
                "energy_ratio": 0.987,
            }
        ],
    }
    text = "\n".join(headline.lines(made))
    for figure in ("10.0%", "256x256", "12.5", "2.25", "0.987"):
        assert figure in text
