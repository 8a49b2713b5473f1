"""The page's picture in README.md and docs/web.md. SUNBEAM_WRITE_PICTURE=1 writes it again."""

from __future__ import annotations

import io
import os

import needs
import numpy as np
from conftest import REPOSITORY
from PIL import Image

# The committed picture, its size in pixels, and the largest size of its file.
PICTURE = REPOSITORY / "docs" / "images" / "web.jpg"
SIZE = (1320, 860)
BYTES_MAX = 150_000
# Largest mean difference of sRGB bytes between the committed picture and the present page. JPEG, another font and other
# numbers in the page stay below it; the absence of the snake adds 8.
DIFFERENCE_MAX = 6.0


def test_the_committed_picture_shows_the_page(page):
    page.browser.resize(*SIZE)
    # The first example.
    page.open({})
    if page.js("return sunbeam.example") != "xenopeltis-scan":
        needs.skip("scans", "the picture shows a scan, and the page was built without the scans: see `make web`")
    page.browser.wait("return sunbeam.engine.hasSpectra(sunbeam.keys.method)", "the spectra", 120)
    # The direction of order 1.
    page.browser.hover("#map", (-98, 2))
    page.browser.wait("return sunbeam.spectrum?.length", "the spectrum", 20)
    shot = Image.open(io.BytesIO(page.browser.screenshot()))
    shot = shot.convert("RGB")
    assert shot.size == SIZE
    if os.environ.get("SUNBEAM_WRITE_PICTURE"):
        shot.save(PICTURE, quality=72, optimize=True)
    committed = Image.open(PICTURE)
    assert committed.size == SIZE
    assert PICTURE.stat().st_size <= BYTES_MAX
    difference = np.abs(np.asarray(committed, float) - np.asarray(shot, float)).mean()
    print(f"difference {difference:.2f}")
    assert difference < DIFFERENCE_MAX
