"""Measures the page in headless Chromium with WebGPU in software: `make bench-web`.

Writes docs/data/web.json, and the table of docs/web.md from it.
"""

from __future__ import annotations

import argparse
import gzip
import json
import re
import statistics
import sys
import tempfile
import threading
from pathlib import Path

import numpy as np
from browser import Browser, Host
from page import Page
from test_files import gsf

REPOSITORY = Path(__file__).resolve().parents[3]
SITE = REPOSITORY / "target" / "web"
DATA = REPOSITORY / "docs" / "data" / "web.json"
DOCUMENT = REPOSITORY / "docs" / "web.md"
# Region of the table.
FIGURES = re.compile(r"(?<=<!-- figures -->\n).*(?=<!-- end of figures -->)", re.DOTALL)
# Number of runs of a step, whose median counts.
REPEATS = 3
# Seconds after which a step counts as failed; every figure is far below.
LIMIT_S = 200
# Sides in pixels of the scan for the memory, and of the scan that is dropped.
LARGE, MEDIUM = 1024, 512


def sizes():
    """Bytes of the built page: its parts after gzip, and the examples."""
    found = {path: path.read_bytes() for path in SITE.rglob("*") if path.is_file()}
    packed = {path: len(gzip.compress(content, 9)) for path, content in found.items()}
    return {
        "wasm_gzipped_bytes": sum(size for path, size in packed.items() if path.suffix == ".wasm"),
        "page_gzipped_bytes": sum(size for path, size in packed.items() if path.parent.name != "examples"),
        "examples_bytes": sum(len(content) for path, content in found.items() if path.parent.name == "examples"),
    }


def mark(page, name):
    """Time in ms of a mark that the page has set."""
    return page.js("return performance.getEntriesByName(arguments[0])[0].startTime", name)


def first_pictures(page):
    """Seconds from the choice of each example to its first picture."""
    rows = {}
    for index, example in enumerate(page.js("return sunbeam.examples")):
        times = []
        for _ in range(REPEATS):
            # The first surface shares no data with the examples.
            page.open({"surface.preset": "sinusoidal"}, limit=LIMIT_S)
            page.js("window.before = sunbeam.good; window.asked = performance.now()")
            page.browser.click(f"input[name=example][value='{index}']")
            page.browser.wait("return sunbeam.good !== before", example["name"], LIMIT_S)
            times.append(first_picture(page))
        rows[example["name"]] = statistics.median(times)
    return rows


def first_picture(page):
    """Seconds from `window.asked` to the first picture of the data made since."""
    page.finished(LIMIT_S)
    return page.js("return (sunbeam.good.at - window.asked) / 1e3")


def opening(page):
    """Seconds from the loading of the page's files to its first picture, that of an example."""
    times = []
    for _ in range(REPEATS):
        page.open({}, limit=LIMIT_S)
        times.append((mark(page, "first-picture") - mark(page, "loaded")) / 1e3)
    return statistics.median(times)


def scan(side):
    """A rough relief without a tilt, in µm, of `side`² pixels of 25 nm."""
    y, x = np.mgrid[:side, :side] * 0.025
    grain = np.random.default_rng(19).normal(0, 0.004, (side, side))
    return (0.1 * np.sin(2 * np.pi * x / 1.6) + 0.05 * np.sin(2 * np.pi * y / 0.62) + grain).astype(np.float32)


def dropping(page, side):
    """Median of seconds from the drop of a scan to its first picture."""
    return statistics.median(drop(page, side) for _ in range(REPEATS))


def drop(page, side):
    """Drops a scan of `side`² pixels onto the page; seconds to its first picture."""
    page.open(limit=LIMIT_S)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.gsf"
        path.write_bytes(gsf(scan(side), metres=0.025e-6))
        page.js("window.asked = performance.now()")
        page.drop(path)
    page.browser.wait("return sunbeam.source && sunbeam.good?.source === sunbeam.source", "the scan", LIMIT_S)
    return first_picture(page)


def drawing(page):
    """Milliseconds of a whole picture of 384 × 256, and from a drag of view or sun to the picture that follows."""
    page.open({}, size="384x256", limit=LIMIT_S)
    # The data of spectra occupy a core for a few seconds after the first picture.
    page.browser.wait("return sunbeam.engine.hasSpectra(sunbeam.keys.method)", "the spectra", LIMIT_S)
    whole = [page.browser.promise("return (await sunbeam.engine.draw()).ms") for _ in range(5)]
    return {
        "picture_ms": statistics.median(whole),
        "drag_ms": dragging(page, "camera"),
        "sun_drag_ms": dragging(page, "sun"),
    }


def dragging(page, target):
    """Milliseconds from a step of the pointer to its picture; `target` is camera or sun."""
    page.browser.click(f"input[name=drag][value={target}]")
    answers = page.browser.promise(
        """const answers = [];
        const canvas = document.getElementById("picture");
        const box = canvas.getBoundingClientRect();
        const point = (kind, x, buttons) => canvas.dispatchEvent(new PointerEvent(kind, {
            pointerId: 1, clientX: box.x + x, clientY: box.y + box.height / 2, buttons,
            button: kind === "pointermove" ? -1 : 0 }));
        // Only a real pointer can be captured.
        canvas.setPointerCapture = () => {};
        point("pointerdown", 100, 1);
        for (let i = 1; i <= 20; i++) {
            const start = performance.now();
            point("pointermove", 100 + 3 * i, 1);
            await new Promise((resolve) => {
                const done = () => sunbeam.drawn.serial === sunbeam.lastOrder;
                const look = () => done() ? resolve() : setTimeout(look, 1);
                look();
            });
            answers.push(performance.now() - start);
        }
        point("pointerup", 160, 0);
        return answers;"""
    )
    return statistics.median(answers)


def memory(host, side):
    """Peak memory in bytes of the page's process, with its workers, while a scan of `side`² pixels is read and shown.

    A fresh browser holds nothing of earlier pages.
    """
    peak, ended = [0], threading.Event()

    def watch(browser):
        while not ended.wait(0.2):
            peak[0] = max(peak[0], used(browser))

    with Browser() as browser:
        watching = threading.Thread(target=watch, args=[browser])
        watching.start()
        try:
            page = Page(browser, host)
            drop(page, side)
            browser.wait("return sunbeam.engine.hasSpectra(sunbeam.keys.method)", "the spectra", LIMIT_S)
        finally:
            ended.set()
            watching.join()
    return peak[0]


def used(browser):
    """Proportional set size in bytes of the browser's largest process that shows pages."""
    pids = [
        path.parent
        for path in Path("/proc").glob("[0-9]*/cmdline")
        if str(browser.folder).encode() in content(path) and b"--type=renderer" in content(path)
    ]
    found = [re.search(r"^Pss:\s+(\d+)", content(pid / "smaps_rollup").decode(), re.MULTILINE) for pid in pids]
    return max((1024 * int(pss[1]) for pss in found if pss), default=0)


def content(path):
    """The bytes of a file; empty if its process has ended."""
    try:
        return path.read_bytes()
    except OSError:
        return b""


def table(found):
    """The table of docs/web.md."""
    rows = [
        ("the library, gzipped", f"{found['wasm_gzipped_bytes'] / 1e6:.2f} MB", "≤ 1.3 MB"),
        ("the whole page without examples, gzipped", f"{found['page_gzipped_bytes'] / 1e6:.2f} MB", "≤ 2 MB"),
        ("the examples", f"{found['examples_bytes'] / 1e3:.0f} kB", "–"),
        ("first picture of an example, after the files are loaded", f"{found['opening_s']:.1f} s", "≤ 3 s"),
        (f"first picture of a dropped scan of {MEDIUM}²", f"{found['dropping_s']:.1f} s", "≤ 6 s"),
        ("a whole picture of 384 × 256", f"{found['picture_ms']:.0f} ms", "≤ 200 ms"),
        ("from a drag of the view to the picture that follows", f"{found['drag_ms']:.0f} ms", "2 frames, 33 ms"),
        ("from a drag of the sun to the picture that follows", f"{found['sun_drag_ms']:.0f} ms", "2 frames, 33 ms"),
        (f"most memory with a scan of {LARGE}²", f"{found['memory_bytes'] / 1e6:.0f} MB", "≤ 600 MB"),
    ]
    lines = ["| figure | measured | aim |", "| --- | --- | --- |", *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n" + "\n".join(lines) + "\n\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--table", action="store_true", help="write the table from the numbers that are there")
    options = parser.parse_args()
    # Before the measurements, so that numbers are never written without their table.
    if not FIGURES.search(DOCUMENT.read_text(encoding="utf-8")):
        sys.exit(f"{DOCUMENT} has no region <!-- figures --> to <!-- end of figures -->")
    if not options.table:
        host = Host(SITE)
        host.page = f"{host.url}/"
        with Browser() as browser:
            page = Page(browser, host)
            found = {**sizes(), "opening_s": opening(page), "examples_s": first_pictures(page)}
            found["dropping_s"] = dropping(page, MEDIUM)
            found.update(drawing(page))
            found["browser"] = browser.version
        found["memory_bytes"] = memory(host, LARGE)
        host.close()
        DATA.write_text(json.dumps(found, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    found = json.loads(DATA.read_text(encoding="utf-8"))
    DOCUMENT.write_text(FIGURES.sub(lambda _: table(found), DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
    print(table(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
