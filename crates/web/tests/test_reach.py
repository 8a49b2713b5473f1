"""Accessibility of the page: axe-core, keys, narrow screens, dark mode, browsers without WebGPU; and its size."""

from __future__ import annotations

import graphlib
import hashlib
import re
import shutil
import subprocess
import tarfile

import needs
import numpy as np
import pytest
from browser import Browser
from conftest import REPOSITORY, SITE
from page import SMALL, Page
from selenium.webdriver.common.keys import Keys
from test_page import map_sum

# Version of axe-core, a checker of accessibility, and the hash of its archive.
AXE = "4.14.1"
AXE_SHA256 = "e6b0ce02b84d892e2e33e403485e7f3d6c29e2be6df65daf44d89ba564139745"
# Style with low contrast in the light scheme alone, a negative control.
PALE_IN_THE_LIGHT = "@media (prefers-color-scheme: light) { label { color: #ccc !important } }"
# A host name that the browser maps to this machine.
ELSEWHERE = "sunbeam.test"


@pytest.fixture(scope="session")
def axe():
    """The source of axe-core, fetched once from npm's registry and checked; the test is skipped where that fails."""
    folder = REPOSITORY / "target" / "axe-core"
    archive = folder / f"axe-core-{AXE}.tgz"
    if not archive.exists():
        if not shutil.which("npm"):
            needs.skip("axe", "npm is missing, which fetches axe-core")
        folder.mkdir(parents=True, exist_ok=True)
        done = subprocess.run(
            ["npm", "pack", "--silent", f"axe-core@{AXE}"], cwd=folder, capture_output=True, text=True, timeout=120
        )
        if done.returncode:
            needs.skip("axe", f"axe-core could not be fetched: {done.stderr[-300:]}")
    assert hashlib.sha256(archive.read_bytes()).hexdigest() == AXE_SHA256
    with tarfile.open(archive) as packed:
        return packed.extractfile("package/axe.min.js").read().decode()


def violations(page, axe):
    """A line for each rule of axe-core that the page violates, with the elements."""
    page.js(axe)
    found = page.browser.promise(
        """// Waits for colours in transition between the schemes.
        await Promise.all(document.getAnimations().map(({ finished }) => finished.catch(() => {})));
        const { violations } = await axe.run(document, { resultTypes: ["violations"] });
        return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target.join(" ")).join(", ")}`);"""
    )
    # Drops messages that axe itself causes.
    page.browser.console()
    return found


def expect_no_violations(page, axe):
    """Checks the page at three widths in both colour schemes."""
    for width in [360, 900, 1400]:
        page.browser.resize(width, 1000)
        for dark in [False, True]:
            page.browser.dark(dark)
            assert violations(page, axe) == [], (width, dark)


def test_axe_finds_no_violation(page, axe):
    page.open(size=SMALL)
    expect_no_violations(page, axe)
    # Again with all parts of the page shown.
    page.js("for (const hidden of document.querySelectorAll('[hidden]')) hidden.hidden = hidden.id === 'still'")
    page.js("document.querySelector('#message span').textContent = 'A line.'")
    page.js("document.querySelector('#progress-text').textContent = 'Making'")
    expect_no_violations(page, axe)
    # Negative controls: a missing label, and a low contrast in the light scheme.
    page.js("document.querySelector('label[for=method]').remove()")
    assert any(line.startswith("select-name") for line in violations(page, axe))
    page.js(
        "document.styleSheets[0].insertRule(arguments[0], document.styleSheets[0].cssRules.length)", PALE_IN_THE_LIGHT
    )
    for dark in [True, False]:
        page.browser.dark(dark)
        assert any(line.startswith("color-contrast") for line in violations(page, axe)) is not dark
    # The next test loads the page again.
    page.browser.go("about:blank")


@pytest.mark.parametrize("width", [320, 360, 900, 1400])
def test_nothing_exceeds_the_width_of_the_window(page, width):
    page.browser.resize(width, 900)
    page.reopen(size=SMALL)
    assert page.js("return document.documentElement.scrollWidth <= innerWidth")
    sticking = page.js(
        """return [...document.querySelectorAll("main *, header *, footer *")]
            .filter((one) => !one.closest(".cards") && one.getBoundingClientRect().right > innerWidth + 1)
            .map((one) => one.id || one.className)"""
    )
    assert sticking == []
    # No text is cut off.
    assert (
        page.js(
            """return [...document.querySelectorAll("button, label, dt, dd, h2, legend")]
            .filter((one) => one.scrollWidth > one.clientWidth + 1 && getComputedStyle(one).display !== "inline")
            .map((one) => one.textContent)"""
        )
        == []
    )


def test_dark_and_light_have_different_grounds(page):
    grounds = []
    for dark in [False, True]:
        page.browser.dark(dark)
        page.reopen(size=SMALL)
        ground = page.js("return getComputedStyle(document.documentElement).backgroundColor")
        grounds.append([int(channel) for channel in re.findall(r"\d+", ground)])
    assert min(grounds[0][:3]) > 200
    assert max(grounds[1][:3]) < 50


def test_the_tab_key_reaches_every_control_with_a_visible_focus(page):
    page.reopen(size=SMALL)
    page.js("document.activeElement.blur(); window.scrollTo(0, 0)")
    name = "const one = document.activeElement; return one.id || one.name || one.textContent.trim().slice(0, 20)"
    reached, rings = [], []
    for _ in range(80):
        page.browser.keys(Keys.TAB)
        found = page.js(name)
        if reached and found == reached[0]:
            break
        reached.append(found)
        rings.append(
            page.js(
                """const one = document.activeElement;
                const own = [one, one.nextElementSibling, one.closest("label")].filter(Boolean);
                return own.some((each) => parseFloat(getComputedStyle(each).outlineWidth) >= 2);"""
            )
        )
    wanted = page.js(
        """return [...document.querySelectorAll("input, select, button, canvas[tabindex]")]
            .filter((one) => !one.disabled && one.offsetParent && one.type !== "radio")
            .map((one) => one.id || one.textContent)"""
    )
    assert set(wanted) <= set(reached)
    assert {"scene", "drag", "example"} <= set(reached)
    assert all(ring for ring, one in zip(rings, reached) if one in wanted)


@pytest.mark.parametrize("secure", [True, False], ids=["no-adapter", "no-interface"])
def test_without_webgpu_there_are_a_message_pictures_and_the_map(host, secure, tmp_path):
    """Without flags for software there is no adapter, and over http from another host no WebGPU at all."""
    with Browser([f"--host-resolver-rules=MAP {ELSEWHERE} 127.0.0.1"]) as browser:
        page = Page(browser, host)
        if not secure:
            page.address = host.page.replace("127.0.0.1", ELSEWHERE)
        page.open({"surface.preset": "blazed"}, drawn=False)
        assert page.js("return navigator.gpu !== undefined") is secure
        assert ("https" in page.js("return document.getElementById('no-gpu-reason').textContent")) is not secure
        notice = page.js("const n = document.getElementById('no-gpu'); return n.hidden ? '' : n.textContent")
        assert "WebGPU" in notice
        assert "Chrome" in notice
        page.browser.wait("return sunbeam.map?.side === 128", "the map", 120)
        assert page.canvas_colours("#map") > 50
        assert page.canvas_colours("#relief-picture") > 5
        page.browser.hover("#map", (20, 0))
        page.browser.wait("return sunbeam.spectrum?.length === 81", "the spectrum")
        assert max(page.js("return Array.from(sunbeam.spectrum)")) > 0
        before = map_sum(page)
        page.write("#map_theta", 50)
        page.browser.wait("return sunbeam.wi[0] > 0.7", "the other light")
        assert map_sum(page) != before
        # Ready-made pictures of the examples.
        page.js("document.querySelector('input[name=example]').click()")
        page.browser.wait("return document.getElementById('still').naturalWidth === 288", "the ready-made picture")
        assert page.canvas_colours("#still") > 300
        # Files are read.
        path = tmp_path / "scan.npy"
        np.save(path, np.sin(np.arange(1024).reshape(32, 32)).astype(np.float32) * 0.1)
        page.drop(path)
        page.browser.wait("return !document.getElementById('scale').hidden", "the question")
        page.expect_no_errors(but="No available adapters.")


def test_the_built_files_are_small():
    """Sizes are those after gzip; docs/web.md has the measured ones."""
    import gzip

    sizes = {path: len(gzip.compress(path.read_bytes(), 9)) for path in SITE.rglob("*") if path.is_file()}
    (wasm,) = [size for path, size in sizes.items() if path.suffix == ".wasm"]
    assert 100e3 < wasm <= 1.3e6
    assert sum(size for path, size in sizes.items() if path.suffix != ".gsf") <= 2e6


def test_committed_data_are_small():
    """Examples are built from presets and scans."""
    listed = subprocess.run(["git", "ls-files", "-z", "crates/web"], cwd=REPOSITORY, capture_output=True, check=True)
    paths = [REPOSITORY / name for name in listed.stdout.decode().split("\0") if name]
    code = {".rs", ".js", ".py", ".html", ".css", ".toml", ".lock", ".md"}
    data = [path.stat().st_size for path in paths if path.suffix not in code and path.exists()]
    assert len(paths) > 30
    assert sum(data) <= 300e3


def test_modules_of_the_page_import_in_one_direction():
    pattern = re.compile(r'^import .*? from "\./([\w.]+)";', re.MULTILINE)
    modules = {path.name: pattern.findall(path.read_text()) for path in (REPOSITORY / "crates/web/page").glob("*.js")}
    assert len(modules) > 15
    # Raises CycleError.
    list(graphlib.TopologicalSorter(modules).static_order())
