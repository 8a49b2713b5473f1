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
from pathlib import Path

import numpy as np
from browser import Browser, Host
from page import Page
from test_files import gsf

REPOSITORY = Path(__file__).resolve().parents[3]
SITE = REPOSITORY / "target" / "web"
DATA = REPOSITORY / "docs" / "data" / "web.json"
DOCUMENT = REPOSITORY / "docs" / "web.md"
FIGURES = re.compile(r"(?<=<!-- figures -->\n).*(?=<!-- end of figures -->)", re.DOTALL)
REPEATS = 3
# Of the surface that memory is measured with, and of the scan that is dropped.
LARGE, MEDIUM = 1024, 512


def sizes():
    found = {path: path.read_bytes() for path in SITE.rglob("*") if path.is_file()}
    packed = {path: len(gzip.compress(content, 9)) for path, content in found.items()}
    return {
        "wasm_gzipped_bytes": sum(size for path, size in packed.items() if path.suffix == ".wasm"),
        "page_gzipped_bytes": sum(size for path, size in packed.items() if path.parent.name != "examples"),
        "examples_bytes": sum(len(content) for path, content in found.items() if path.parent.name == "examples"),
    }


def mark(page, name):
    return page.js("return performance.getEntriesByName(arguments[0])[0].startTime", name)


def first_pictures(page):
    """Seconds from the files' being loaded to the first picture of each example and to the finest."""
    rows = {}
    for index, example in enumerate(page.js("return sunbeam.examples")):
        times = []
        for _ in range(REPEATS):
            page.open({}, drawn=False)
            # Nothing of the surface that is drawn at first is to be of use.
            page.finished(200)
            times.append(
                page.browser.promise(
                    """const [index] = args;
                    const drawn = new Promise((resolve) => {
                        const look = () => sunbeam.drawn !== before && !sunbeam.making && sunbeam.drawn
                            ? resolve(performance.now()) : requestAnimationFrame(look);
                        const before = sunbeam.drawn;
                        sunbeam.drawn = null;
                        requestAnimationFrame(look);
                    });
                    const start = performance.now();
                    document.querySelectorAll("input[name=example]")[index].click();
                    return (await drawn - start) / 1e3;""",
                    index,
                )
            )
        rows[example["name"]] = statistics.median(times)
    return rows


def opening(page):
    """Seconds from the page's being loaded to its first picture, which is that of an example."""
    times = []
    for _ in range(REPEATS):
        page.open({}, drawn=True, limit=200)
        times.append((mark(page, "first-picture") - mark(page, "loaded")) / 1e3)
    return statistics.median(times)


def scan(side):
    """A rough, levelled relief in µm as a scan of so many pixels, 25 nm each."""
    y, x = np.mgrid[:side, :side] * 0.025
    grain = np.random.default_rng(19).normal(0, 0.004, (side, side))
    return (0.1 * np.sin(2 * np.pi * x / 1.6) + 0.05 * np.sin(2 * np.pi * y / 0.62) + grain).astype(np.float32)


def dropping(page, side):
    """Seconds from a scan's falling onto the page to its first picture."""
    times = []
    for repeat in range(REPEATS):
        page.open(limit=200)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"scan-{repeat}.gsf"
            path.write_bytes(gsf(scan(side), metres=0.025e-6))
            page.js("sunbeam.drawn = null; window.dropped = performance.now()")
            page.drop(path)
        page.browser.wait("return sunbeam.source && sunbeam.good?.source === sunbeam.source", "the scan", 200)
        page.finished(200)
        times.append(page.js("return (sunbeam.good.at - window.dropped) / 1e3"))
    return statistics.median(times)


def drawing(page):
    """Milliseconds of a whole picture of 384 × 256, and between a drag and the picture that follows it."""
    page.open({}, size="384x256", limit=200)
    whole = [page.browser.promise("return (await sunbeam.engine.draw()).ms") for _ in range(5)]
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
                const done = () => sunbeam.asked && sunbeam.drawn.serial === sunbeam.asked.serial;
                const look = () => done() ? resolve() : setTimeout(look, 1);
                look();
            });
            answers.push(performance.now() - start);
        }
        point("pointerup", 160, 0);
        return answers;"""
    )
    return statistics.median(whole), statistics.median(answers)


def memory(page, side):
    """Bytes of the page's process, its workers in it, when a scan of so many pixels is shown."""
    dropping(page, side)
    pids = [
        path.parent
        for path in Path("/proc").glob("[0-9]*/cmdline")
        if str(page.browser.folder).encode() in content(path) and b"--type=renderer" in content(path)
    ]
    rollups = [content(pid / "smaps_rollup").decode() for pid in pids]
    return max(1024 * int(re.search(r"^Pss:\s+(\d+)", text, re.MULTILINE)[1]) for text in rollups if text)


def content(path):
    try:
        return path.read_bytes()
    except OSError:
        return b""


def table(found):
    rows = [
        ("the library, gzipped", f"{found['wasm_gzipped_bytes'] / 1e6:.2f} MB", "≤ 1.3 MB"),
        ("the whole page without examples, gzipped", f"{found['page_gzipped_bytes'] / 1e6:.2f} MB", "≤ 2 MB"),
        ("the examples", f"{found['examples_bytes'] / 1e3:.0f} kB", "≤ 300 kB"),
        ("first picture of an example, after the files are loaded", f"{found['opening_s']:.1f} s", "≤ 3 s"),
        (f"first picture of a dropped scan of {MEDIUM}²", f"{found['dropping_s']:.1f} s", "≤ 6 s"),
        ("a whole picture of 384 × 256", f"{found['picture_ms']:.0f} ms", "≤ 200 ms"),
        ("from a drag to the picture that follows", f"{found['drag_ms']:.0f} ms", "2 frames, 33 ms"),
        (f"memory with a scan of {LARGE}²", f"{found['memory_bytes'] / 1e6:.0f} MB", "≤ 600 MB"),
    ]
    lines = ["| figure | measured | aim |", "| --- | --- | --- |", *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n" + "\n".join(lines) + "\n\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--table", action="store_true", help="write the table from the numbers that are there")
    if not parser.parse_args().table:
        host = Host(SITE)
        host.page = f"{host.url}/"
        with Browser() as browser:
            page = Page(browser, host)
            found = {**sizes(), "opening_s": opening(page), "examples_s": first_pictures(page)}
            found["dropping_s"] = dropping(page, MEDIUM)
            found["picture_ms"], found["drag_ms"] = drawing(page)
            found["memory_bytes"] = memory(page, LARGE)
            found["browser"] = browser.version
        host.close()
        DATA.write_text(json.dumps(found, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    found = json.loads(DATA.read_text(encoding="utf-8"))
    DOCUMENT.write_text(FIGURES.sub(lambda _: table(found), DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
    print(table(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
