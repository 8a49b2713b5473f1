"""Files dropped on the page: complete ones, ones without scale or with holes, and broken ones."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest
from browser import until
from page import SMALL
from test_page import click, expect_same, twin

# Edge of the reliefs' pixels.
PIXEL_UM = 0.1


def heights(side=64):
    """A relief in µm without a tilt, different from all presets."""
    y, x = np.mgrid[:side, :side] * PIXEL_UM
    return (0.12 * np.sin(2 * np.pi * x / 1.6) + 0.05 * np.sin(2 * np.pi * (x + y) / 0.8)).astype(np.float32)


def gsf(values, metres=PIXEL_UM * 1e-6, zunits="m", **changed):
    """The bytes of a Gwyddion Simple Field of heights in µm; `metres` is a pixel's edge, `changed` other fields."""
    rows, columns = values.shape
    fields = {
        "XRes": columns, "YRes": rows, "XReal": columns * metres, "YReal": rows * metres,
        "XYUnits": "m", "ZUnits": zunits, **changed,
    }  # fmt: skip
    header = "Gwyddion Simple Field 1.0\n" + "".join(f"{k} = {v}\n" for k, v in fields.items() if v is not None)
    header = header.encode()
    return header + b"\0" * (4 - len(header) % 4) + (values * 1e-6).astype("<f4").tobytes()


def png(width, height, depth, kind, rows):
    """The bytes of a PNG with this bit depth and colour type; the bytes `rows` have a filter before each row."""

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def name_shown(page):
    return page.js("return document.getElementById('relief-name').textContent")


def dropped(page, path, by_hand=False):
    """Drops a file onto the page, or chooses it `by_hand`, and waits until it is read or refused."""
    (page.choose_file if by_hand else page.drop)(path)
    until(lambda: name_shown(page) == path.name or page.message(), 60, f"{path.name} to be read")


@pytest.mark.parametrize("by_hand", [False, True], ids=["dropped", "chosen"])
def test_a_file_with_a_scale_agrees_with_the_native_renderer(page, tmp_path, by_hand):
    path = tmp_path / "scan.gsf"
    path.write_bytes(gsf(heights()))
    page.reopen(size=SMALL)
    dropped(page, path, by_hand)
    found = page.pixels()
    assert page.settings()["surface"]["filename"] == "scan.gsf"
    assert "6.4 µm × 6.4 µm" in page.js("return document.getElementById('relief-facts').innerText")
    expected = twin(page.settings(), tmp_path, "--size", SMALL, "--file", path)
    expect_same(found, expected)
    with pytest.raises(AssertionError):
        expect_same(np.roll(found, 2, axis=0), expected)


def test_the_page_asks_for_a_missing_scale(page, tmp_path):
    path = tmp_path / "scan.npy"
    np.save(path, heights())
    page.reopen(size=SMALL)
    before = page.pixels()
    page.drop(path)
    page.browser.wait("return !document.getElementById('scale').hidden", "the question")
    assert "pixel" in page.js("return document.getElementById('scale-question').textContent")
    assert page.js("return document.activeElement.id") == "pixel_size"
    page.browser.type("#pixel_size", f"{PIXEL_UM}\n")
    until(lambda: page.settings()["surface"].get("pixel_size") == PIXEL_UM, 10, "the scale")
    page.finished()
    found = page.pixels()
    assert not np.array_equal(found, before)
    expect_same(found, twin(page.settings(), tmp_path, "--size", SMALL, "--file", path))
    # Another scale gives another picture.
    page.write("#pixel_size", 0.2)
    click("#scale button")(page)
    until(lambda: not np.array_equal(page.pixels(), found), 30, "the other scale")


def test_the_page_asks_for_the_height_of_whole_numbers(page, tmp_path):
    levels = np.round(255 * (heights() - heights().min()) / np.ptp(heights())).astype(np.uint8)
    rows = b"".join(b"\0" + row.tobytes() for row in levels)
    path = tmp_path / "scan.png"
    path.write_bytes(png(64, 64, 8, 0, rows))
    page.reopen(size=SMALL)
    page.drop(path)
    for parameter, answer in [("pixel_size", PIXEL_UM), ("max_height", 0.3)]:
        page.browser.wait(
            f"return !document.getElementById('scale').hidden && document.activeElement.id === '{parameter}'",
            f"the question for {parameter}",
        )
        page.browser.type(f"#{parameter}", f"{answer}\n")
    until(lambda: name_shown(page) == "scan.png", 30, "the file")
    page.finished()
    # Without levelling, which would change the range.
    page.choose("#level", "none")
    page.finished()
    assert page.js("return document.getElementById('relief-range').textContent") == "0 to 0.3 µm"
    expect_same(page.pixels(), twin(page.settings(), tmp_path, "--size", SMALL, "--file", path))


def test_missing_points_are_filled_and_channels_chosen(page, tmp_path):
    import tifffile

    values = heights()
    values[10:13, 20:24] = np.nan
    path = tmp_path / "holes.tiff"
    other = heights()[::-1].copy()
    tifffile.imwrite(path, np.stack([values, other]), photometric="minisblack")
    page.open(
        {"surface.filename": "holes.tiff", "surface.pixel_size": PIXEL_UM, "surface.fill": "laplace"},
        size=SMALL,
        drawn=False,
    )
    page.drop(path)
    page.finished()
    assert page.js("return sunbeam.relief.facts.filled_points") == 12
    assert "Filled" in page.js("return document.getElementById('relief-facts').innerText")
    filled = page.pixels()
    page.choose("#fill", "mean")
    until(lambda: not np.array_equal(page.pixels(), filled), 30, "the other filling")
    assert page.settings()["surface"]["fill"] == "mean"
    page.write("#channel", "1")
    until(lambda: page.settings()["surface"].get("channel") == "1", 10, "the channel")
    page.finished()
    assert "Filled" not in page.js("return document.getElementById('relief-facts').innerText")


def test_a_link_to_a_file_names_it_and_checks_it(page, tmp_path):
    path = tmp_path / "scan.gsf"
    path.write_bytes(gsf(heights()))
    page.reopen(size=SMALL)
    dropped(page, path)
    page.browser.drag("#picture", (0, 0), (40, 20))
    expected = page.pixels()
    page.browser.wait("return location.hash.includes('sha256=')", "the address")
    link = page.js("return location.hash.slice(1)")
    fields = dict(pair.split("=") for pair in link.split("&"))

    page.open(fields, size=SMALL, drawn=False)
    wanted = page.js("return document.getElementById('wanted').textContent")
    assert "scan.gsf" in wanted
    assert fields["sha256"][:12] in wanted
    dropped(page, path)
    np.testing.assert_allclose(page.pixels(), expected, atol=1e-6)
    assert not page.message()

    other = tmp_path / "other.gsf"
    other.write_bytes(gsf(2 * heights()))
    page.open(fields, size=SMALL, drawn=False)
    page.drop(other)
    page.finished()
    assert "not the file that the link was made with" in page.message()
    assert not np.array_equal(page.pixels(), expected)


def bad_files(folder):
    """Files that are not height fields, each broken in another way."""
    good = gsf(heights(16))
    np.save(folder / "complex.npy", np.ones((4, 4), complex))
    np.save(folder / "deep.npy", np.ones((3, 4, 5)))
    np.save(folder / "objects.npy", np.array([[{}, 1]], dtype=object))
    np.save(folder / "line.npy", np.ones(7))
    np.save(folder / "whole.npy", np.ones((16, 16)))
    whole = (folder / "whole.npy").read_bytes()
    (folder / "whole.npy").unlink()
    files = {
        "empty.gsf": b"",
        "words.gsf": b"This is not a scan.",
        "short.gsf": good[:-40],
        "vast.gsf": gsf(heights(4), XRes=1000000, YRes=1000000),
        "nothing.gsf": gsf(heights(4), XRes=0),
        "holes.gsf": gsf(np.full((4, 4), np.nan, np.float32)),
        "volts.gsf": gsf(heights(4), zunits="V"),
        "magic.gwy": b"GWYP",
        "noise.gwy": b"GWYP" + np.random.default_rng(1).bytes(4000),
        "short.npy": whole[:300],
        "vast.npy": whole[:128].replace(b"(16, 16)", b"(99999, 99999)"),
        "colour.png": png(2, 2, 8, 2, b"\0" + bytes(6) + b"\0" + bytes(6)),
        "broken.png": png(4, 4, 8, 0, b"")[:50],
        "not.exr": b"v/1\x01 and no more",
        "letters.txt": b"one two three\nfour five six\n",
        "ragged.csv": b"1,2,3\n4,5\n",
        "lost.tiff": b"II*\0\xff\xff\xff\x7f",
        "holiday.jpg": b"\xff\xd8\xff\xe0" + bytes(100),
        "points.xyz": b"0 0 1\n1 0 2\n0.3 7 1\n",
    }
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return sorted(folder.iterdir())


def test_each_bad_file_gives_one_line_of_its_own(page, tmp_path):
    page.reopen(size=SMALL)
    expected = page.pixels()
    files = bad_files(tmp_path)
    assert len(files) >= 20
    messages = {}
    for path in files:
        page.drop(path)
        page.browser.wait("return !document.getElementById('message').hidden", f"a message about {path.name}", 20)
        line = page.message()
        assert "\n" not in line
        assert 15 < len(line) < 300
        assert path.name in line, line
        messages[path.name] = line.replace(path.name, "")
        page.finished()
        assert page.settings()["surface"].get("filename") is None
        click("#message button")(page)
    np.testing.assert_array_equal(page.pixels(), expected)
    # Most messages differ in more than the name.
    assert len(set(messages.values())) >= 15
    page.choose("#preset", "sinusoidal")
    page.finished()
    assert not np.array_equal(page.pixels(), expected)


def test_a_table_beyond_the_memory_limit_is_refused_with_advice(page, tmp_path):
    path = tmp_path / "nanometres.gsf"
    path.write_bytes(gsf(heights() * 800))
    page.reopen(size=SMALL)
    page.drop(path)
    page.browser.wait("return !document.getElementById('message').hidden", "the refusal")
    assert "GB" in page.message()
    assert "coherence length" in page.message()
    page.finished()
    assert page.settings()["surface"]["preset"] == "blazed"
