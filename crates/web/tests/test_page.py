"""The page in a browser: its pictures, every control, sharing, and trouble."""

from __future__ import annotations

import json
import re
import subprocess
import urllib.parse
from xml.etree import ElementTree

import numpy as np
import pytest
from browser import Browser, until
from conftest import PLACE, REPOSITORY
from difference import lab, shown_difference
from page import QUICK, SMALL, Page
from selenium.webdriver.common.keys import Keys

METHODS = ["table", "flss", "nmm", "pq", "stam"]
# Largest median and 99th percentile of ΔE2000 between the page's picture and the native one. Both run the same shaders
# in single precision. Compilers of two adapters round differently, and an edge of the mesh that passes through a
# pixel's centre may fall on either side of it.
MEDIAN_MAX, P99_MAX = 0.5, 2.0
# The page's default exposure in stops.
EXPOSURE = 2.0
# The W3C's definition of a long task, in ms.
LONG_MS = 50


# Pictures


def test_the_page_opens_with_an_example(page):
    page.open({})
    assert page.js("return document.querySelector('input[name=example]:checked').value") == "0"
    picture = page.pixels()
    assert picture.std() > 0.01
    assert page.canvas_colours() > 1000
    assert page.canvas_colours("#relief-picture") > 30
    assert page.canvas_colours("#map") > 100
    facts = page.js("return document.getElementById('relief-facts').innerText")
    assert "Period along x" in facts
    assert "µm" in facts
    # The bar's fraction of the picture's width is its fraction of the tile.
    label, fraction, extent = page.js(
        """const bar = document.getElementById("bar").getBoundingClientRect();
        const picture = document.getElementById("relief-picture").getBoundingClientRect();
        const label = document.getElementById("bar-length").textContent;
        return [label, bar.width / picture.width, sunbeam.relief.facts.extent_um[0]];"""
    )
    assert fraction * extent == pytest.approx(float(label.split()[0]), rel=0.03)


def twin(settings, folder, *arguments):
    """The picture of the settings by the native renderer in software, linear sRGB (height, width, 3).

    `arguments` are those of examples/page_twin.rs.
    """
    (folder / "settings.json").write_text(json.dumps(settings))
    command = [REPOSITORY / "target" / "release" / "examples" / "page_twin", folder / "settings.json"]
    done = subprocess.run(
        [*command, *arguments, "-o", folder / "native.npy"], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return np.load(folder / "native.npy")


def expect_same(found, expected):
    """Checks that two pictures in linear sRGB look alike."""
    difference = shown_difference(found, expected, EXPOSURE)
    assert np.median(difference) <= MEDIAN_MAX
    assert np.percentile(difference, 99) <= P99_MAX


@pytest.mark.parametrize("method", METHODS)
def test_pixels_agree_with_the_native_renderer(page, tmp_path, method):
    # Larger steps, since the default ones would take a browser without a graphics card 15 s.
    step = {"options.lambda_step_nm": 20} if method == "flss" else {}
    page.reopen({"surface.preset": "elaphe", "method": method, **step}, size=SMALL)
    found = page.pixels()
    expected = twin(page.settings(), tmp_path, "--size", SMALL)
    assert found.shape == expected.shape
    # The pictures are not black.
    assert (found.max(axis=-1) > 0.02).mean() > 0.05
    expect_same(found, expected)
    # Negative controls: a quarter brighter, and shifted by eight pixels.
    for other in [expected * 1.25, np.roll(expected, 8, axis=1)]:
        with pytest.raises(AssertionError):
            expect_same(other, expected)


@pytest.mark.parametrize("shape", ["flat", "sphere"])
def test_flat_and_sphere_agree_with_the_native_renderer(page, tmp_path, shape):
    page.reopen({**QUICK, "shape": shape}, size=SMALL)
    expect_same(page.pixels(), twin(page.settings(), tmp_path, "--size", SMALL))


def test_a_film_in_a_link_agrees_with_the_native_renderer(page, tmp_path):
    film = {**QUICK, "shape": "sphere", "sun.azimuth_deg": 80, "surface.eta": 1.5}
    page.reopen({**film, "surface.transmission": "film"}, size=SMALL)
    found = page.pixels()
    assert page.js("return document.getElementById('transmission').checked")
    expect_same(found, twin(page.settings(), tmp_path, "--size", SMALL))
    # Negative control: the same surface without transmission.
    page.reopen(film, size=SMALL)
    with pytest.raises(AssertionError):
        expect_same(page.pixels(), found)


def test_the_map_agrees_with_the_native_renderer(page, tmp_path):
    page.reopen({**QUICK, "map.theta_deg": 20, "map.phi_deg": 35}, size=SMALL)
    page.browser.wait("return sunbeam.map?.side === 128", "the map")
    found = np.array(page.js("return Array.from(sunbeam.map.rgb)")).reshape(128, 128, 3)
    expected = twin(page.settings(), tmp_path, "--map", "128").reshape(128, 128, 3)
    bright = np.percentile(expected[expected > 0], 99)
    np.testing.assert_allclose(found, expected, atol=1e-3 * bright, rtol=2e-3)
    assert not np.allclose(found, expected[:, ::-1], atol=1e-2 * bright)


def test_colour_difference_agrees_with_published_pairs():
    """Pairs of Sharma, Wu and Dalal 2005, and white."""
    from difference import delta_e

    pairs = [
        ((50.0, 2.6772, -79.7751), (50.0, 0.0, -82.7485), 2.0425),
        ((50.0, -1.0, 2.0), (50.0, 0.0, 0.0), 2.3669),
        ((50.0, 2.49, -0.001), (50.0, -2.49, 0.0011), 7.2195),
        ((22.7233, 20.0904, -46.694), (23.0331, 14.973, -42.5619), 2.0373),
        ((2.0776, 0.0795, -1.135), (0.9033, -0.0636, -0.5514), 0.9082),
    ]
    for first, second, expected in pairs:
        assert delta_e(np.array([first]), np.array([second]))[0] == pytest.approx(expected, abs=1e-4)
    assert lab(np.ones(3)) == pytest.approx([100, 0, 0], abs=1e-3)


# Controls. The next four functions return actions on a page.


def option(css, value):
    return lambda page: page.choose(css, value)


def text(css, value):
    return lambda page: page.write(css, value)


def click(css):
    return lambda page: page.js("document.querySelector(arguments[0]).click()", css)


def keys(css, *names):
    def press(page):
        page.js("document.querySelector(arguments[0]).focus()", css)
        page.browser.keys(*names)

    return press


# By control: an action, the path and value of the setting after it, and the parts of the page that change (`seen`).
CONTROLS = {
    "preset": (option("#preset", "sinusoidal"), ("surface", "preset"), "sinusoidal", "picture relief map"),
    "period": (text("#period", "1.7"), ("surface", "period"), 1.7, "picture relief map"),
    "height": (text("#height", "0.4"), ("surface", "height"), 0.4, "picture map"),
    "level": (option("#level", "plane"), ("surface", "level"), "plane", "picture map"),
    "tiling": (option("#tiling", "aperiodic"), ("surface", "tiling"), "aperiodic", "picture map"),
    "method": (option("#method", "stam"), ("method",), "stam", "picture map"),
    "coherence_length": (text("#coherence_length", "20"), ("surface", "coherence_length"), 20, "picture map"),
    "pattern": (keys("#pattern", Keys.LEFT), ("surface", "scale"), 0.99, "picture map"),
    "depth": (keys("#depth", Keys.LEFT), ("surface", "depth"), 0.99, "picture map"),
    "cover_eta": (text("#cover_eta", "1.5"), ("surface", "cover_eta"), 1.5, "picture map"),
    "transmission": (click("#transmission"), ("surface", "transmission"), "film", "picture map"),
    "conserve_energy": (click("#conserve_energy"), ("surface", "conserve_energy"), True, "picture"),
    "material": (option("#material", "Polycarbonate"), ("surface", "eta"), 1.58, "picture map"),
    "eta": (text("#eta", "1.9"), ("surface", "eta"), 1.9, "picture map"),
    "k": (text("#k", "2"), ("surface", "k"), 2, "picture map"),
    "azimuth": (keys("#azimuth", Keys.RIGHT, Keys.RIGHT), ("sun", "azimuth_deg"), -149, "picture"),
    "elevation": (keys("#elevation", Keys.RIGHT), ("sun", "elevation_deg"), 40.5, "picture"),
    "blend": (option("#blend", "none"), ("pigment",), "none", "picture"),
    "exposure": (keys("#exposure", Keys.RIGHT), ("exposure",), 2.25, "canvas"),
    "map_theta": (text("#map_theta", "50"), ("map", "theta_deg"), 50, "map"),
    "map_phi": (text("#map_phi", "70"), ("map", "phi_deg"), 70, "map"),
    "scene-flat": (click("input[value=flat]"), ("shape",), "flat", "picture"),
    "scene-sphere": (click("input[value=sphere]"), ("shape",), "sphere", "picture"),
}
# Controls with tests of their own: they need a file, a device, an error or a clipboard.
ELSEWHERE = {
    "file", "pixel_size", "max_height", "fill", "channel", "size", "cancel", "recover", "save-png", "save-exr",
    "copy-link", "copy-xml", "copy-command", "reset", "scene-snake", "drag-camera", "drag-sun", "scale-submit",
    "message-dismiss", "example",
}  # fmt: skip


def seen(page, part):
    """A comparable value of a part of the page."""
    if part == "picture":
        return page.pixels().tobytes()
    if part == "canvas":
        return page.browser.screenshot()
    if part == "relief":
        # The picture of a grating's tile does not depend on the period, its numbers do.
        return page.js(
            "return document.getElementById('relief-picture').toDataURL() + "
            "document.getElementById('relief-facts').textContent"
        )
    page.finished()
    page.browser.wait("return sunbeam.map?.side === 128", "the map")
    return map_sum(page)


def map_sum(page):
    """A sum over the map's values whose weights tell neighbours apart."""
    return page.js("return sunbeam.map.rgb.reduce((sum, value, i) => sum + value * (1 + i % 7), 0)")


@pytest.mark.parametrize("name", CONTROLS)
def test_each_control_changes_its_setting_and_the_page(page, name):
    act, path, expected, parts = CONTROLS[name]
    # The energy limiter acts on conductors, whose albedo may exceed 1.
    conductor = {"surface.eta": 0.96, "surface.k": 6.69, "sun.elevation_deg": 10} if name == "conserve_energy" else {}
    page.reopen({"surface.preset": "blazed", "surface.level": "none", **conductor}, size=SMALL)
    before = {part: seen(page, part) for part in parts.split()}
    act(page)
    found = page.settings()
    for key in path:
        found = found[key]
    assert found == expected
    assert not page.message()
    for part, earlier in before.items():
        until(lambda part=part, earlier=earlier: seen(page, part) != earlier, 30, f"{part} to change")


def test_every_control_has_a_test(page):
    page.reopen()
    named = page.js(
        """return [...document.querySelectorAll("input, select, button")].map((field) => {
            if (field.name === "example") return "example";
            if (field.type === "radio") return `${field.name}-${field.value}`;
            if (field.type === "submit") return `${field.form.id}-submit`;
            return field.id || `${field.parentElement.id}-dismiss`;
        })"""
    )
    assert set(named) == set(CONTROLS) | ELSEWHERE


def test_dragging_turns_the_view_moves_it_and_turns_the_sun(page):
    page.reopen(size=SMALL)
    before = page.settings()

    def drag(**options):
        page.browser.drag("#picture", (0, 0), (60, -30), **options)
        return page.settings()

    # A pixel turns view and sun by 0.35°.
    turned = drag()
    assert turned["camera"]["azimuth_deg"] == pytest.approx(before["camera"]["azimuth_deg"] - 21, abs=0.5)
    assert turned["camera"]["target"] == before["camera"]["target"]
    moved = drag(button=1)
    assert moved["camera"]["target"] != turned["camera"]["target"]
    assert moved["camera"]["azimuth_deg"] == turned["camera"]["azimuth_deg"]
    # The page does not scroll by the middle button.
    refused = [
        page.js(
            """
            const event = new MouseEvent("mousedown", { button: arguments[0], cancelable: true });
            return !document.getElementById("picture").dispatchEvent(event);""",
            button,
        )
        for button in (0, 1)
    ]
    assert refused == [False, True]
    sunny = drag(button=2)
    assert sunny["camera"] == moved["camera"]
    assert sunny["sun"]["elevation_deg"] == pytest.approx(before["sun"]["elevation_deg"] + 10.5, abs=0.5)
    click("input[value=sun]")(page)
    again = drag()
    assert again["sun"]["azimuth_deg"] == pytest.approx(sunny["sun"]["azimuth_deg"] + 21, abs=0.5)
    page.browser.drag("#sky", (0, 0), (20, 0))
    assert page.settings()["sun"] != again["sun"]
    click("input[value=camera]")(page)
    page.browser.click("#reset")
    after = page.settings()
    assert (after["camera"], after["sun"]) == (before["camera"], before["sun"])


def test_wheel_fingers_and_keys_zoom_and_turn(page):
    page.reopen(size=SMALL)
    start = page.settings()["camera"]
    page.browser.wheel("#picture", -240)
    near = page.settings()["camera"]["distance_cm"]
    assert near < 0.9 * start["distance_cm"]

    x, y = page.browser.middle("#picture")
    page.browser.fingers(*([(x + side * gap, y) for gap in (40, 80, 120)] for side in (-1, 1)))
    nearer = page.settings()["camera"]
    # Three times the distance of the fingers gives a third of the distance of the camera.
    assert nearer["distance_cm"] == pytest.approx(near / 3, rel=0.05)
    keys("#picture", Keys.LEFT, Keys.UP, "+")(page)
    turned = page.settings()
    assert turned["camera"]["azimuth_deg"] > nearer["azimuth_deg"]
    assert turned["camera"]["elevation_deg"] < nearer["elevation_deg"]
    assert turned["camera"]["distance_cm"] < nearer["distance_cm"]
    keys("#picture", (Keys.SHIFT, Keys.RIGHT), "-")(page)
    assert page.settings()["sun"]["azimuth_deg"] > turned["sun"]["azimuth_deg"]
    assert page.settings()["camera"]["distance_cm"] == pytest.approx(nearer["distance_cm"])
    keys("#picture", "r")(page)
    assert page.settings()["camera"] == start


def test_the_picture_has_the_chosen_resolution(page):
    page.reopen()
    for size in ["768x512", SMALL, "384x256"]:
        page.choose("#size", size)
        height, width, _ = page.pixels().shape
        assert f"{width}x{height}" == size
        assert f"{width} × {height}" in page.words()


def test_pointing_at_the_map_reads_direction_spectrum_and_colour(page):
    page.reopen({"surface.preset": "blazed", "map.theta_deg": 0}, size=SMALL)
    page.browser.wait("return sunbeam.map?.side === 128 && sunbeam.wi[2] === 1", "the map of light from above")
    # A point right of the middle and above it.
    box = page.js("return document.getElementById('map').getBoundingClientRect().width")
    page.browser.hover("#map", (round(0.2 * box), round(-0.1 * box)))
    x, y, z = page.js("return sunbeam.wo")
    assert (x, y) == pytest.approx((0.4, 0.2), abs=0.02)
    assert x * x + y * y + z * z == pytest.approx(1)
    theta = np.degrees(np.arccos(z))
    assert f"θ {theta:.1f}°" in page.js("return document.getElementById('fact-wo').textContent")
    # For light along the normal the half vector has half the polar angle.
    assert f"θ {theta / 2:.1f}°" in page.js("return document.getElementById('fact-h').textContent")
    # Order 1 of a period of 2.5 µm leaves at asin(λ/2.5 µm) in the plane of incidence.
    for nm in [450, 620]:
        sine = nm / 2500
        page.browser.hover("#map", (round(sine * box / 2), 0))
        page.browser.wait("return sunbeam.spectrum?.length === 81", "the spectrum")
        until(lambda nm=nm: abs(380 + 5 * np.argmax(spectrum_of(page)) - nm) < 25, 20, f"a peak at {nm} nm")
    name = page.js("return document.getElementById('spectrum').getAttribute('aria-label')")
    assert "strongest at" in name
    red, green, blue = map(int, page.js("return getComputedStyle(swatch).backgroundColor.match(/\\d+/g).slice(0, 3)"))
    assert red > max(green, blue)
    # Keys move the point, too: by 0.02 in direction sines, with the shift key by 0.1.
    keys("#map", Keys.UP, (Keys.SHIFT, Keys.RIGHT))(page)
    moved = page.js("return sunbeam.wo")
    assert moved[:2] == pytest.approx([sine + 0.1, 0.02], abs=0.02)


def spectrum_of(page):
    return page.js("return Array.from(sunbeam.spectrum)")


def test_pointing_at_the_snake_shows_its_half_vector_in_the_map(page):
    page.reopen(size=SMALL)
    page.browser.hover("#picture", (0, 10))
    # A point of an earlier test may still be shown.
    page.browser.wait("return sunbeam.settings.map.phi_deg !== 0 && sunbeam.wo", "the place on the snake")
    page.browser.wait("return sunbeam.map.side === 128 && sunbeam.wi[1] !== 0", "its map in full")
    wi, wo = page.js("return [Array.from(sunbeam.wi), Array.from(sunbeam.wo)]")
    found = page.browser.promise(
        """const { height } = document.getElementById("picture").getBoundingClientRect();
        return sunbeam.engine.query(0.5, 0.5 + 10 / height);"""
    )
    assert wi == pytest.approx(found["wi"], abs=2e-3)
    assert wo == pytest.approx(found["wo"], abs=2e-2)
    mark = page.js("return document.querySelector('#map-marks .half').getAttribute('transform')")
    x, y = map(float, re.findall(r"-?[\d.]+(?:e-\d+)?", mark))
    assert (x, -y) == pytest.approx(tuple(found["half"][:2]), abs=2e-2)
    # The map keeps the light when the pointer leaves, and so does the link.
    page.browser.hover("#controls", (0, 0))
    page.browser.wait("return sunbeam.map.side === 128", "the map in full")
    assert page.settings()["map"]["theta_deg"] == pytest.approx(np.degrees(np.arccos(wi[2])), abs=0.1)


# Sharing


def copied(page, button):
    """The text on the clipboard after a click on the button."""
    page.browser.devtools("Browser.grantPermissions", permissions=["clipboardReadWrite", "clipboardSanitizedWrite"])
    page.browser.click(button)
    page.browser.wait("return document.getElementById('status').textContent.includes('copied')", "the clipboard")
    return page.browser.promise("return navigator.clipboard.readText()")


def test_a_link_gives_the_same_picture(page):
    page.reopen(size=SMALL)
    page.browser.drag("#picture", (0, 0), (40, 20))
    page.write("#period", "1.9")
    page.choose("#material", "Polycarbonate")
    page.choose("#blend", "mix")
    click("input[value=sphere]")(page)
    expected, settings = page.pixels(), page.settings()
    link = copied(page, "#copy-link")
    assert link.startswith(page.host.page)
    page.open(dict(urllib.parse.parse_qsl(link.split("#")[1])), size=SMALL)
    assert page.settings() == settings
    np.testing.assert_allclose(page.pixels(), expected, atol=1e-6)
    assert page.js("return location.href") == link


def test_a_wrong_link_gives_a_message_and_the_defaults(page):
    page.open({"surface.preset": "nothing", "method": "magic"}, size=SMALL, drawn=False)
    assert "link" in page.message()
    page.finished()
    page.open({"surface.coherence_length": -1}, size=SMALL, drawn=False)
    assert "coherence_length" in page.message()
    page.open({"__proto__.polluted": 1, "constructor.prototype.polluted": 1}, size=SMALL, drawn=False)
    assert page.js("return ({}).polluted === undefined")


def test_a_link_overrides_an_example_that_is_being_fetched(page):
    page.reopen(size=SMALL)
    # The answer to the page's request for the example's file is held back.
    page.js(
        """const { fetch } = globalThis;
        globalThis.fetch = (address) =>
            new Promise((resolve) => (globalThis.answer = () => resolve(fetch(address))));
        const index = sunbeam.examples.findIndex(({ file }) => file);
        document.querySelector(`input[name=example][value="${index}"]`).click();
        globalThis.fetch = fetch;"""
    )
    page.reopen({**QUICK, "surface.period": 1.8})
    expected = page.settings()
    page.browser.promise("globalThis.answer(); await new Promise((resolve) => setTimeout(resolve, 500));")
    assert page.settings() == expected
    assert page.js("return sunbeam.source === null")
    page.finished()


def test_the_copied_command_draws_the_same_picture(page, tmp_path):
    page.reopen({**QUICK, "sun.azimuth_deg": -120, "surface.period": 1.8}, size=SMALL)
    found = page.pixels()
    command = copied(page, "#copy-command")
    assert command.startswith("sunbeam render ")
    words = command.replace("\\\n", " ").split()
    words[0] = str(REPOSITORY / "target" / "release" / "sunbeam")
    words[words.index("-o") + 1] = str(tmp_path / "command.exr")
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    expect_same(found, read_exr(tmp_path / "command.exr"))


def read_exr(path):
    """The linear RGB of an EXR file, (height, width, 3)."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    return np.array(mitsuba.Bitmap(str(path)))[..., :3]


def test_the_copied_scene_has_the_diffraction_bsdf(page):
    page.reopen({**QUICK, "surface.period": 1.8}, size=SMALL)
    scene = ElementTree.fromstring(copied(page, "#copy-xml"))
    (bsdf,) = [found for found in scene.iter("bsdf") if found.get("type") == "diffraction"]
    given = {found.get("name"): found.get("value") for found in bsdf}
    assert given["preset"] == "blazed"
    assert float(given["period"]) == 1.8


def test_saved_files_agree_with_the_screen(page):
    from PIL import Image

    page.reopen({**QUICK, "map.theta_deg": 20}, size=SMALL)
    linear = page.pixels()
    page.browser.click("#save-png")
    saved = np.asarray(Image.open(page.downloaded("blazed.png")).convert("RGB"), float) / 255
    assert f"{saved.shape[1]}x{saved.shape[0]}" == SMALL
    # Below its knee, at 0.8, the tone curve is the identity.
    decoded = np.where(saved <= 0.04045, saved / 12.92, ((saved + 0.055) / 1.055) ** 2.4)
    exposed = linear * 2**EXPOSURE
    below = (exposed.max(axis=-1) < 0.75) & (exposed.min(axis=-1) >= 0)
    assert below.mean() > 0.5
    np.testing.assert_allclose(decoded[below], exposed[below], atol=0.006)
    page.browser.click("#save-exr")
    found = read_exr(page.downloaded("blazed-brdf.exr"))
    assert found.shape == (256, 256, 3)
    # The map on the page has half the side.
    page.browser.wait("return sunbeam.map?.side === 128", "the map")
    shown = np.array(page.js("return Array.from(sunbeam.map.rgb)")).reshape(128, 128, 3)
    coarse = found.reshape(128, 2, 128, 2, 3).mean(axis=(1, 3))
    lit = shown.max(axis=-1) > 0
    assert np.corrcoef(coarse[lit].ravel(), shown[lit].ravel())[0, 1] > 0.5


# Trouble


def test_cancelling_brings_the_surface_back(page):
    page.reopen(size=SMALL)
    before = page.pixels()
    example = page.js("return sunbeam.example")
    assert example == "blazed"
    page.choose("#preset", "xenopeltis")
    page.browser.wait(
        "return !document.getElementById('progress').hidden && document.getElementById('progress-bar').value > 0",
        "the progress",
    )
    fractions = [page.js("return document.getElementById('progress-bar').value") for _ in range(3)]
    assert all(0 < fraction <= 1 for fraction in fractions)
    assert fractions == sorted(fractions)
    page.browser.click("#cancel")
    page.browser.wait("return document.getElementById('progress').hidden", "the cancelling", 2)
    assert "Cancelled" in page.words()
    assert page.settings()["surface"]["preset"] == "blazed"
    assert page.js("return document.getElementById('relief-name').textContent.toLowerCase()").startswith("blazed")
    card = "sunbeam.examples[document.querySelector('input[name=example]:checked')?.value]?.name"
    assert page.js(f"return [sunbeam.example, {card}]") == [example, example]
    np.testing.assert_array_equal(page.pixels(), before)
    # The next surface is made.
    page.choose("#preset", "sinusoidal")
    assert not np.array_equal(page.pixels(), before)


def test_cancelling_brings_the_shape_back_too(page):
    page.reopen(size=SMALL)
    before = page.pixels()
    page.js(
        """window.scenes = 0;
        const { engine } = sunbeam;
        const setScene = engine.setScene.bind(engine);
        engine.setScene = (bytes, draft) => setScene(bytes, draft).then(() => { window.scenes += 1; });
        preset.value = "cd";
        preset.dispatchEvent(new Event("change", { bubbles: true }));
        document.querySelector("input[value=sphere]").click();"""
    )
    page.browser.wait("return window.scenes > 0", "the sphere", 20)
    page.browser.click("#cancel")
    assert page.settings()["shape"] == "snake"
    np.testing.assert_allclose(page.pixels(), before, atol=1e-6)


def test_a_change_of_shape_does_not_cancel_the_surface(page):
    page.reopen(size=SMALL)
    # The shape is chosen while the table is made.
    page.js(
        """preset.value = "sinusoidal";
        preset.dispatchEvent(new Event("change", { bubbles: true }));
        document.querySelector("input[value=sphere]").click();"""
    )
    found = page.pixels()
    page.open({"surface.preset": "sinusoidal", "shape": "sphere"}, size=SMALL)
    np.testing.assert_allclose(found, page.pixels(), atol=1e-6)


def test_a_lost_device_is_opened_again(page):
    page.reopen(size=SMALL)
    before = page.pixels()
    page.browser.promise("await sunbeam.engine.loseDevice();")
    page.browser.wait("return document.getElementById('message').textContent.includes('lost')", "the message")
    page.finished()
    np.testing.assert_allclose(page.pixels(), before, atol=1e-6)
    assert page.canvas_colours() > 100
    click("#message button")(page)
    assert not page.message()
    # After a second loss the visitor is asked.
    page.browser.promise("await sunbeam.engine.loseDevice();")
    page.browser.wait("return !document.getElementById('recover').hidden", "the question")
    # A change in the meantime is drawn by the new device.
    page.choose("#preset", "sinusoidal")
    page.browser.wait("return sunbeam.engine.hasReflectance(sunbeam.keys.method)", "the data on the processor")
    page.browser.click("#recover")
    assert not np.array_equal(page.pixels(), before)
    page.choose("#preset", "blazed")
    np.testing.assert_allclose(page.pixels(), before, atol=1e-6)
    # Gestures still work.
    page.browser.drag("#picture", (0, 0), (40, 0))
    assert not np.array_equal(page.pixels(), before)


# Requests and speed


def test_no_other_host_is_requested(page):
    page.open(size=SMALL)
    requested = page.js("return performance.getEntriesByType('resource').map(({ name }) => name)")
    assert len(requested) > 5
    assert all(name.startswith(page.host.page) for name in requested)
    assert all(path.startswith(f"/{PLACE}/") for path in page.host.requested)
    kept = page.js("return [document.cookie, localStorage.length, sessionStorage.length]")
    assert kept == ["", 0, 0]
    page.browser.console()
    # The page's content security policy refuses other hosts.
    refused = page.browser.promise(
        "return fetch(args[0]).then(() => false, () => true);",
        page.host.url.replace("127.0.0.1", "localhost") + "/",
    )
    assert refused
    assert any("Content Security Policy" in text for _, text in page.browser.console())


def test_no_task_of_the_page_is_long(host):
    """No task of the page's own thread takes 50 ms of processor time (wall time would include other programs)."""
    with Browser(traced=True) as browser:
        page = Page(browser, host)
        page.open({}, size=SMALL)
        page.browser.drag("#picture", (0, 0), (80, 20), steps=12)
        page.browser.hover("#picture", (10, 10))
        page.choose("#preset", "elaphe")
        page.finished()
        # Negative control: a long task at the end of the trace. The processor time of its fixed amount of work does not
        # depend on other programs.
        browser.js("""
            setTimeout(() => {
                let sum = 0;
                for (let i = 0; i < 1e9; i++) sum += Math.sqrt(i);
                window.waited = sum > 0;
            })""")
        browser.wait("return window.waited", "the long task")
        *tasks, longest = sorted(browser.task_ms("loaded"))
    assert longest > 5 * LONG_MS
    assert len(tasks) > 200
    assert tasks[-1] < LONG_MS
