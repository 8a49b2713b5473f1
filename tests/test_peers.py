"""The sums that judge between two programs against closed forms, and how another's units become ours.

The other program is not needed.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from docs.figures import __main__ as command
from docs.figures import peers
from docs.figures.peer_program import from_peer, peer_heights, peer_program, peer_words
from docs.figures.peer_sums import ALL, Approximations, Patch, approximate_sum, direct_sum, hemisphere
from mitsuba_scenes.environment import SetupError

PIXEL_UM, SIDE = 0.125, 128
PATCH = Patch(window_um=0.5, theta_i_deg=20.0, phi_i_deg=50.0, wavelength_um=0.55)
WO, LIT = hemisphere(12)
PLACE_UM = (np.arange(SIDE) - SIDE // 2) * PIXEL_UM


def plane(slope_x, slope_y):
    """Heights in µm of a plane through the middle pixel; the window ends long before the tile does."""
    return slope_x * PLACE_UM + slope_y * PLACE_UM[:, None]


def gaussian(slope_x, slope_y, wo=WO, patch=PATCH):
    """`f_r` of a plane in 1/sr in closed form: the power of the window's transform, about the mirror direction."""
    x, y, w = (patch.wi + wo).T
    off_per_um2 = ((x + w * slope_x) ** 2 + (y + w * slope_y) ** 2) / patch.wavelength_um**2
    variance_um2 = patch.window_um**2
    return 4 * np.pi * variance_um2 / patch.wavelength_um**2 * np.exp(-4 * np.pi**2 * variance_um2 * off_per_um2)


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.2, 0.0), (0.1, -0.15)])
def test_a_plane_has_the_transform_of_the_window(slope):
    """To 1e-7 of the largest: the window is summed to six deviations, where it is 1.5e-8."""
    largest = gaussian(*slope).max()
    np.testing.assert_allclose(direct_sum(plane(*slope), PIXEL_UM, PATCH, WO), gaussian(*slope), atol=1e-7 * largest)


def test_a_plane_that_leans_the_other_way_is_told_apart():
    """The negative control of the sign of the Fourier transform."""
    found = direct_sum(plane(0.2, 0.0), PIXEL_UM, PATCH, WO)
    assert np.abs(found - gaussian(-0.2, 0.0)).sum() > found.sum()


def test_a_sinusoid_has_the_orders_of_bessel():
    """To 1e-6: the lobes of neighbouring orders overlap by 3e-9, and 16 pixels a period confuse none that matter."""
    period_um, amplitude_um = 2.0, 0.1
    patch = replace(PATCH, window_um=2.0, theta_i_deg=0.0)
    heights = np.tile(amplitude_um * np.sin(2 * np.pi * PLACE_UM / period_um), (SIDE, 1))
    angle = np.linspace(0, np.pi, 2001)
    for order in (-1, 0, 1):
        sine = order * patch.wavelength_um / period_um
        wo = np.array([[sine, 0.0, np.sqrt(1 - sine**2)]])
        kappa = patch.question(wo)[0][0]
        bessel = np.trapezoid(np.cos(order * angle - kappa * amplitude_um * np.sin(angle)), angle) / np.pi
        peak = 4 * np.pi * patch.window_um**2 / patch.wavelength_um**2
        assert direct_sum(heights, PIXEL_UM, patch, wo)[0] == pytest.approx(bessel**2 * peak, rel=1e-6)


def test_without_approximations_both_sums_are_one():
    rough = np.random.default_rng(3).normal(0, 0.05, (SIDE, SIDE))
    found = approximate_sum(rough, PIXEL_UM, PATCH, WO, Approximations())
    # One ends at a square and the other at the circle in it, where the window is 1.5e-8.
    np.testing.assert_allclose(found, direct_sum(rough, PIXEL_UM, PATCH, WO), rtol=1e-5)


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.1, -0.15)])
def test_gaussian_pixels_of_a_plane_weigh_it_about_its_mirror_direction(slope):
    """In closed form: the plane's lobe times that of a pixel, whose deviation is half its edge."""
    x, y, w = (PATCH.wi + WO).T
    off_per_um2 = ((x + w * slope[0]) ** 2 + (y + w * slope[1]) ** 2) / PATCH.wavelength_um**2
    weighed = gaussian(*slope) * np.exp(-4 * np.pi**2 * (PIXEL_UM / 2) ** 2 * off_per_um2)
    for chosen in (Approximations(gabor_texels=True), Approximations(curved_texels=True)):
        found = approximate_sum(plane(*slope), PIXEL_UM, PATCH, WO, chosen)
        np.testing.assert_allclose(found, weighed, atol=1e-7 * weighed.max())


def test_a_quadratic_phase_mends_what_a_linear_one_costs():
    """Crests and hollows, which linear phases set against each other; what stays is the window's slope over a pixel."""
    wave = 0.1 * np.sin(2 * np.pi * (PLACE_UM - 0.3) / 4.0)
    crests = wave + wave[:, None]
    patch = replace(PATCH, window_um=1.3)
    true = direct_sum(crests, PIXEL_UM, patch, WO)

    def off(**chosen):
        found = approximate_sum(crests, PIXEL_UM, patch, WO, Approximations(**chosen))
        return np.abs(found - true).sum() / true.sum()

    # 0.2 % of 1.2 %.
    assert off(curved_texels=True) < 0.25 * off(gabor_texels=True)


def test_the_programs_rows_lie_along_x_in_units_of_a_pixel():
    heights = np.arange(12.0).reshape(3, 4) / 8
    given = peer_heights(heights, 0.25)
    assert given.dtype == np.float16
    assert given.shape == (4, 3)
    assert given[3, 1] == heights[1, 3] / 0.25


def test_the_program_is_told_where_the_window_stands():
    words = peer_words((128, 256), 0.25, replace(PATCH, theta_i_deg=45.0, phi_i_deg=0.0), 64)
    told = {name: float(words[words.index(name) + 1]) for name in ("-x", "-y", "-p", "-w", "-l", "-s", "-t")}
    middle = {"-x": 128.5 * 0.25, "-y": 64.5 * 0.25, "-s": 1.0, "-t": 0.0}
    assert told == pytest.approx({**middle, "-p": 0.5, "-w": 0.25, "-l": 0.55})
    assert words[words.index("-r") + 1] == "64"


def test_its_factor_is_one_in_the_mirror_direction_and_known_elsewhere():
    """w² / (4 cosθi cosθo): 1.125 between the normal and 60°."""
    normal = replace(PATCH, theta_i_deg=0.0)
    wo = np.array([[0.0, 0.0, 1.0], [np.sqrt(0.75), 0.0, 0.5]])
    np.testing.assert_allclose(from_peer(np.array([3.0, 3.0]), normal, wo), [3.0, 3.0 / 1.125])


def test_a_plane_as_the_program_sees_it():
    """Of its approximations only the window's end is felt where a plane mirrors: 2 exp(−4.5) of the answer."""
    mirrored = PATCH.wi * [-1, -1, 1]
    found = approximate_sum(plane(0, 0), PIXEL_UM, PATCH, mirrored[None], ALL)[0]
    closed = gaussian(0, 0, mirrored[None])[0] * (1 - np.exp(-4.5)) ** 2
    # So rough is the circle of 24 pixels across.
    assert found == pytest.approx(closed, rel=5e-3)


def test_without_the_program_the_page_is_left_alone(monkeypatch, capsys):
    monkeypatch.delenv("PEER", raising=False)
    monkeypatch.setattr(command, "write_page", lambda *_: pytest.fail("the page was written"))
    assert command.main([peers.PAGE]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == 1
    assert printed[0].startswith("peers: left as it is")


def test_what_is_no_program_is_refused(monkeypatch, tmp_path):
    for wrong in (tmp_path / "missing", tmp_path, Path(__file__)):
        monkeypatch.setenv("PEER", str(wrong))
        with pytest.raises(SetupError, match="is not a program"):
            peer_program()
