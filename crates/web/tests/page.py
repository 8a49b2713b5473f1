"""Actions of a visitor on the page, and the state that tests compare."""

from __future__ import annotations

import base64
import contextlib
import time

import numpy as np
from browser import until

# Records errors; runs before the page's own code.
WATCH = """
    window.faults = [];
    addEventListener("error", (event) => faults.push(String(event.message)));
    addEventListener("unhandledrejection", (event) => faults.push(String(event.reason)));
"""
# Chooses a size before the page's own code reads it: no larger picture is drawn first.
AT_SIZE = """
    document.addEventListener("readystatechange", () => {
        const field = document.getElementById("size");
        if (field) field.value = "SIZE";
    }, { once: true });
"""
# Settings whose data take least time: a grating.
QUICK = {"surface.preset": "blazed"}
SMALL = "192x128"


class Page:
    """The page in a browser. `js` runs code in it; the page's state is its global `sunbeam`."""

    def __init__(self, browser, host):
        self.browser = browser
        self.host = host
        self.address = host.page
        browser.devtools("Page.addScriptToEvaluateOnNewDocument", source=WATCH)
        browser.devtools("Page.enable")
        self.js = browser.js

    def open(self, fields=QUICK, size=None, drawn=True, limit=120):
        """Opens the page with these settings in its address, and waits for the picture."""
        # From the same page, an address with another # would not load it again.
        self.browser.go("about:blank")
        with self.ahead(AT_SIZE.replace("SIZE", size)) if size else contextlib.nullcontext():
            self.browser.go(self.address + hash_of(fields))
        self.browser.wait("return document.body.dataset.ready !== undefined", "the page to start", limit)
        if drawn:
            self.finished(limit)
        return self

    @contextlib.contextmanager
    def ahead(self, code):
        """Has pages that are opened in this context run `code` first."""
        name = self.browser.devtools("Page.addScriptToEvaluateOnNewDocument", source=code)
        try:
            yield
        finally:
            self.browser.devtools("Page.removeScriptToEvaluateOnNewDocument", **name)

    def reopen(self, fields=QUICK, size=None):
        """`open` without loading the page again where it is there, like a link within the page."""
        if not self.js("return Boolean(document.body?.dataset.ready !== undefined && globalThis.sunbeam?.adapter)"):
            return self.open(fields, size)
        self.browser.promise(
            """await new Promise((resolve) => {
                // This listener runs after the page's own. The event needs a change of the address.
                addEventListener("hashchange", resolve, { once: true });
                history.replaceState(null, "", location.pathname);
                location.hash = args[0];
            });""",
            hash_of(fields),
        )
        if size and self.js("return document.getElementById('size').value") != size:
            self.choose("#size", size)
        self.finished()
        return self

    def finished(self, limit=120):
        """Waits until the finest picture of the present settings is drawn."""
        self.browser.wait(IS_FINISHED, f"the picture ({self.words()})", limit)

    def words(self):
        """The page's lines of text about its state."""
        return self.js(
            "return ['#status', '#message', '#progress-text', '#lost-text']"
            ".map((css) => document.querySelector(css)?.textContent).join(' | ')"
        )

    def settings(self):
        return self.js("return sunbeam.settings")

    def message(self):
        """The line about an error; empty without one."""
        return self.js("return message.hidden ? '' : message.querySelector('span').textContent")

    def pixels(self):
        """The picture on the canvas: linear sRGB."""
        self.finished()
        found = self.browser.promise(
            """
            const { width, height, rgb } = await sunbeam.engine.pixels();
            const bytes = new Uint8Array(rgb.buffer);
            let text = "";
            for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
            return { width, height, bytes: btoa(text) };"""
        )
        values = np.frombuffer(base64.b64decode(found["bytes"]), np.float32)
        return values.reshape(found["height"], found["width"], 3)

    def canvas_colours(self, css="#picture"):
        """Number of colours in a screenshot of the element, which shows what is visible."""
        from io import BytesIO

        from PIL import Image

        picture = Image.open(BytesIO(self.browser.element(css).screenshot_as_png)).convert("RGB")
        return len(picture.getcolors(picture.width * picture.height))

    def choose(self, css, value):
        """Chooses an option of a list by its value, by a click."""
        self.browser.click(f"{css} option[value='{value}']")

    def write(self, css, text):
        """Replaces the text of a field and leaves the field."""
        self.js("const field = document.querySelector(arguments[0]); field.focus(); field.select?.()", css)
        self.browser.type(css, str(text))
        self.js("document.activeElement.blur()")

    def choose_file(self, path):
        self.browser.type("#file", str(path))

    def drop(self, path):
        """Drops a file onto the page."""
        text = base64.b64encode(path.read_bytes()).decode()
        self.js(
            """
            const bytes = Uint8Array.from(atob(arguments[1]), (letter) => letter.charCodeAt(0));
            const dataTransfer = new DataTransfer();
            dataTransfer.items.add(new File([bytes], arguments[0]));
            for (const kind of ["dragenter", "dragover", "drop"]) {
                const event = new DragEvent(kind, { dataTransfer, bubbles: true, cancelable: true });
                document.getElementById("stage").dispatchEvent(event);
            }""",
            path.name,
            text,
        )

    def downloaded(self, name):
        path = self.browser.downloads / name
        until(path.exists, 30, f"the download of {name}, beside {list(self.browser.downloads.iterdir())}")
        # Chromium renames a download to this when it is complete.
        time.sleep(0.1)
        return path

    def expect_no_errors(self, but=None):
        """Fails on errors and warnings of page or browser, except those that contain `but`."""
        faults = self.js("return window.faults?.splice(0) ?? []")
        console = [entry for entry in self.browser.console() if entry[0] in ("SEVERE", "WARNING")]
        console = [[level, text] for level, text in console if but is None or but not in text]
        assert not faults
        assert not console


IS_FINISHED = """
    const shown = (id) => !document.getElementById(id).hidden;
    const { drawn, asked, good, making } = globalThis.sunbeam;
    const complete = asked && drawn?.finest && drawn.serial === asked;
    return good && !making && complete && !shown("progress") && !shown("lost");
"""


def hash_of(fields):
    return "#" + "&".join(f"{key}={value}" for key, value in fields.items())
