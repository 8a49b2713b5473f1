"""Actions of a visitor on the page, and the state that tests compare.

The page's state is its global `sunbeam` (crates/web/page/state.js).
"""

from __future__ import annotations

import base64
import contextlib
import time

import numpy as np
from browser import until

# Code that records errors, and runs before the page's own.
WATCH = """
    window.faults = [];
    addEventListener("error", (event) => faults.push(String(event.message)));
    addEventListener("unhandledrejection", (event) => faults.push(String(event.reason)));
"""
# Code that chooses a size before the page's own code reads it, so that no larger picture is drawn first.
AT_SIZE = """
    document.addEventListener("readystatechange", () => {
        const field = document.getElementById("size");
        if (field) field.value = "SIZE";
    }, { once: true });
"""
# Settings whose data are built fastest, those of a grating. Keys are paths in the settings.
QUICK = {"surface.preset": "blazed"}
# Size of quick pictures, an option of the page's list.
SMALL = "192x128"


class Page:
    """The page in a browser. `js` is that of the browser."""

    def __init__(self, browser, host):
        self.browser = browser
        self.host = host
        self.address = host.page
        browser.devtools("Page.addScriptToEvaluateOnNewDocument", source=WATCH)
        browser.devtools("Page.enable")
        self.js = browser.js

    def open(self, fields=QUICK, size=None, drawn=True, limit=120):
        """Opens the page with these settings in its address; waits for the picture if `drawn`, for `limit` seconds."""
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
        """Like `open`, but without loading the page again if it is loaded, as by a link within the page."""
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
        """The page's settings (crates/web/README.md)."""
        return self.js("return sunbeam.settings")

    def message(self):
        """The line about an error; empty without one."""
        return self.js("return message.hidden ? '' : message.querySelector('span').textContent")

    def pixels(self):
        """The finished picture in linear sRGB, (height, width, 3)."""
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
        """Chooses a file in the page's dialogue."""
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
        """Waits for a download; returns its path."""
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


# Code that tells whether the finest picture of the last order is shown, with complete data.
IS_FINISHED = """
    const shown = (id) => !document.getElementById(id).hidden;
    const { drawn, lastOrder, good, making } = globalThis.sunbeam;
    const complete = lastOrder && drawn?.finest && drawn.serial === lastOrder;
    return good && !making && complete && !shown("progress") && !shown("lost");
"""


def hash_of(fields):
    """The part of an address from # on that has these settings."""
    return "#" + "&".join(f"{key}={value}" for key, value in fields.items())
