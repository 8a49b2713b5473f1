"""BRDF maps without drawing maps: orientation of surfaces, and the Taylor series against closed forms."""

import numpy as np
import pytest

from docs.figures import map_checks as checks
from docs.figures.map_surfaces import Surface, Surfaces, cut_out
from docs.figures.taylor_sums import SIZE, WAVELENGTH_UM, neighbours, sums

# Series, transforms and closed forms are all in double precision; what cancels between the parts here is below 1e4.
TOLERANCE = 1e-10


@pytest.fixture(scope="module")
def relief():
    """A random tile of 3.2 µm, 0.2 µm high, on which its window is as wide as it is."""
    heights = np.random.default_rng(7).uniform(0.0, 0.2, (32, 32))
    return Surface("random", (), 0.1, heights - heights.min(), 3.2)


def test_partial_sums_match_closed_forms(relief):
    """At one direction after another: F{(cosh κh + cos κh)/2} and its like, and F{e^(iκh)} for the whole."""
    found = sums(relief)
    place = (np.arange(SIZE) + 0.5) * 2 / SIZE - 1
    for row, column in [(50, 50), (20, 61), (77, 30), (49, 4)]:
        x, y = place[column], -place[row]
        kappa_h = 2 * np.pi * (1 + np.sqrt(1 - x * x - y * y)) / WAVELENGTH_UM * relief.heights_um
        bins, window = neighbours(relief, np.array([x]), np.array([y]))
        closed = [
            (np.cosh(kappa_h) + np.cos(kappa_h)) / 2,
            1j * (np.sinh(kappa_h) + np.sin(kappa_h)) / 2,
            -(np.cosh(kappa_h) - np.cos(kappa_h)) / 2,
            -1j * (np.sinh(kappa_h) - np.sin(kappa_h)) / 2,
            np.exp(1j * kappa_h),
        ]
        for part, screen in zip(found.limits, closed):
            expected = (np.fft.ifft2(screen)[bins] * window).sum()
            assert part[row * SIZE + column] == pytest.approx(
                expected, abs=TOLERANCE * np.nanmax(abs(found.limits[0])), rel=0
            )


def test_the_series_converges_within_its_bound(relief):
    found = sums(relief)
    figures = found.figures()
    assert figures["argument"] == pytest.approx(4 * np.pi * relief.heights_um.max() / 0.38)
    assert figures["whole"] <= figures["bound"] < figures["bound_of_the_source"]
    # One after the other: the last term that matters is in one of them, and those before it in the others.
    assert max(figures["parts"]) - min(figures["parts"]) <= 3
    assert max(figures["parts"]) == figures["whole"]


def test_cut_outs_have_y_up_about_the_middle_and_a_bar_to_scale():
    heights = np.zeros((20, 20))
    # To the right of the middle of the window and above it.
    heights[2, 1] = 1.0
    picture = np.asarray(cut_out(Surface("spot", (), 0.5, heights), 5.0, 2.0, 10))
    assert np.unravel_index(picture[:9, :, 1].argmax(), (9, 10)) == (2, 6)
    bar = np.asarray(cut_out(Surface("flat", (), 0.5, np.eye(20)), 5.0, 2.0, 100))
    red = (bar[..., 0] > 200) & (bar[..., 2] < 60)
    # Ends of a line are counted.
    assert abs(red.sum(axis=1).max() - 40) <= 1


def test_a_tile_cut_out_has_the_picture_of_its_square(tmp_path, monkeypatch):
    # Without the skins, which are not needed.
    monkeypatch.setattr("docs.figures.map_surfaces.SKINS", ())
    surface = Surface("random", (), 0.5, np.random.default_rng(3).random((20, 24)))
    tile = Surfaces(tmp_path).cut(surface, 4.5)
    assert tile.heights_um.shape == (9, 9)
    assert tile.heights_um[0, 0] == surface.heights_um[0, 0]
    assert np.array_equal(cut_out(tile, 4.5, None, 36), cut_out(surface, 4.5, None, 36))


def test_smallest_invisible_number_of_terms_is_found_by_series():
    rows = [
        {"caption": f"N = {n}, {name}", "delta_e_lit": error}
        for name, errors in (
            ("about the base", (9, 9, 2)),
            ("about the middle", (0.5, 3, 0.2)),
            ("Chebyshev", (0.9, 0.1, 0)),
        )
        for n, error in zip((2, 4, 8), errors)
    ]
    assert checks.terms_seen(rows) == {"base": None, "middle": 8, "chebyshev": 2}


def test_rises_means_strictly_increasing():
    assert checks.rises([0.1, 0.2, 0.3])
    assert not checks.rises([0.1, 0.3, 0.3])
