"""Headless Chromium, driven through chromedriver's HTTP interface (the W3C's WebDriver), and a static host."""

from __future__ import annotations

import base64
import bisect
import contextlib
import functools
import http.server
import json
import math
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
BASE = (
    "--headless=new",
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    # A page that was left would keep its workers and its memory.
    "--disable-features=BackForwardCache",
    "--disable-component-update",
    "--disable-dev-shm-usage",
    "--disable-sync",
    # Colours are compared, so they are not to be those of a screen.
    "--force-color-profile=srgb",
)
# WebGPU in software. With the first flag alone the device is lost as soon as a canvas is drawn on.
WEBGPU = (
    "--enable-unsafe-webgpu",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
NO_WEBGPU = ("--disable-features=WebGPU,WebGPUService", "--disable-gpu", "--disable-blink-features=WebGPU")
# All tasks of all threads, from the browser's start to its end: chromedriver's own log ends after 100 000 lines.
TRACE = (
    "--trace-startup=toplevel,blink.user_timing",
    "--trace-startup-duration=0",
    "--trace-startup-format=json",
    "--trace-startup-owner=controller",
)
# WebDriver's name for the property that holds an element's number.
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"


def missing() -> str | None:
    """What is not installed of what the tests need, in words; `None` when all is there."""
    if not any(shutil.which(name) for name in BROWSERS):
        return "Chromium is not installed (on Debian: apt-get install chromium chromium-driver)"
    if not shutil.which("chromedriver"):
        return "chromedriver is not installed (on Debian: apt-get install chromium-driver)"
    return None


class WebDriverError(RuntimeError):
    """What chromedriver answered instead of a value."""


class Browser:
    """One window. `flags` are Chromium's; `traced` is for `task_ms`."""

    def __init__(self, flags=WEBGPU, size=(1400, 1000), traced=False):
        self.folder = Path(tempfile.mkdtemp(prefix="sunbeam-browser-"))
        self.downloads = self.folder / "downloads"
        self.downloads.mkdir()
        self.trace = self.folder / "trace.json"
        port = free_port()
        self.root = f"http://127.0.0.1:{port}"
        self.log = (self.folder / "chromedriver.log").open("w")
        self.process = subprocess.Popen(["chromedriver", f"--port={port}"], stdout=self.log, stderr=self.log)
        self.session = self.version = ""
        arguments = [
            *BASE,
            *flags,
            *((*TRACE, f"--trace-startup-file={self.trace}") if traced else ()),
            f"--window-size={size[0]},{size[1]}",
            f"--user-data-dir={self.folder / 'profile'}",
        ]
        options = {
            "binary": next(path for path in map(shutil.which, BROWSERS) if path),
            "args": arguments,
            "prefs": {"download.default_directory": str(self.downloads), "download.prompt_for_download": False},
        }
        wanted = {
            "browserName": "chrome",
            "goog:loggingPrefs": {"browser": "ALL"},
            "goog:chromeOptions": options,
            "timeouts": {"script": 240000, "pageLoad": 60000},
        }
        try:
            until(self.answers, 20, "chromedriver to start")
            started = self.call("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
            self.session = f"/session/{started['sessionId']}"
            self.version = f"Chromium {started['capabilities']['browserVersion']}"
            # The size of the page and not of a window around it.
            self.resize(*size)
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def quit(self):
        """Ends the browser, which writes its trace then."""
        if self.session:
            self.call("DELETE", self.session)
        self.session = ""

    def close(self):
        with contextlib.suppress(OSError, WebDriverError):
            self.quit()
        self.process.terminate()
        self.process.wait(20)
        self.log.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def call(self, method, path, body=None):
        request = urllib.request.Request(
            self.root + path,
            method=method,
            data=None if body is None else json.dumps(body).encode(),
            headers={"Content-Type": "application/json"},
        )
        try:
            with urllib.request.urlopen(request, timeout=300) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            value = json.load(error)["value"]
            raise WebDriverError(f"{value['error']}: {value['message']}") from None

    def answers(self):
        try:
            return self.call("GET", "/status")["ready"]
        except OSError:
            return False

    def post(self, path, body):
        return self.call("POST", self.session + path, body)

    def devtools(self, command, **parameters):
        """A command of Chromium's own."""
        return self.post("/goog/cdp/execute", {"cmd": command, "params": parameters})

    def resize(self, width, height, scale=1):
        self.devtools(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=False
        )

    def dark(self, on=True):
        features = [{"name": "prefers-color-scheme", "value": "dark" if on else "light"}]
        self.devtools("Emulation.setEmulatedMedia", features=features)

    def go(self, url):
        self.post("/url", {"url": url})

    def js(self, code, *arguments):
        """What the body of a function returns."""
        return self.post("/execute/sync", {"script": code, "args": list(arguments)})

    def promise(self, code, *arguments):
        """What the body of an asynchronous function resolves to."""
        script = f"""
            const done = arguments[arguments.length - 1];
            (async (...args) => {{ {code} }})(...arguments).then(
                (value) => done({{ value: value ?? null }}), (error) => done({{ error: String(error) }}));"""
        found = self.post("/execute/async", {"script": script, "args": list(arguments)})
        if "error" in found:
            raise WebDriverError(found["error"])
        return found["value"]

    def element(self, css):
        return self.post("/element", {"using": "css selector", "value": css})[ELEMENT]

    def click(self, css):
        self.post(f"/element/{self.element(css)}/click", {})

    def type(self, css, text):
        self.post(f"/element/{self.element(css)}/value", {"text": text})

    def screenshot(self):
        return base64.b64decode(self.call("GET", f"{self.session}/screenshot"))

    def console(self):
        """Messages since the last call, as [level, text]."""
        found = self.post("/se/log", {"type": "browser"})
        return [[entry["level"], entry["message"]] for entry in found]

    def task_ms(self, mark):
        """Processor time in ms of each task of the page's own thread that began after it had set this mark.

        Of a browser that is `traced`, which ends here. What chromedriver has the thread do is not counted.
        """
        self.quit()
        events = json.loads(self.trace.read_text())["traceEvents"]
        marks = {(event["pid"], event["tid"]): event["ts"] for event in events if event["name"] == mark}
        events = [event for event in events if event["ts"] > marks.get((event["pid"], event["tid"]), math.inf)]
        driven = sorted(event["ts"] for event in events if "blink.mojom.DevTools" in json.dumps(event.get("args")))
        tasks = [event for event in events if event["name"].endswith("RunTask") and "tdur" in event]
        return [
            task["tdur"] / 1e3
            for task in tasks
            # None of the driver's messages lies between its ends.
            if bisect.bisect_left(driven, task["ts"]) == bisect.bisect_right(driven, task["ts"] + task["dur"])
        ]

    def actions(self, kind, steps, pointer="mouse"):
        source = {"type": kind, "id": f"{kind}-{pointer}", "actions": steps}
        if kind == "pointer":
            source["parameters"] = {"pointerType": pointer}
        self.post("/actions", {"actions": [source]})

    def drag(self, css, start, way, button=0, steps=4, pointer="mouse"):
        """Presses at a place of the element, both in pixels from its middle, and moves along `way`."""
        x, y = self.middle(css)
        moves = [
            {
                "type": "pointerMove",
                "x": round(x + start[0] + way[0] * i / steps),
                "y": round(y + start[1] + way[1] * i / steps),
                "duration": 20,
            }
            for i in range(steps + 1)
        ]
        down, up = ({"type": kind, "button": button} for kind in ("pointerDown", "pointerUp"))
        self.actions("pointer", [moves[0], down, *moves[1:], up], pointer)

    def hover(self, css, place):
        """Moves the pointer to a place of the element, in pixels from its middle."""
        x, y = self.middle(css)
        self.actions("pointer", [{"type": "pointerMove", "x": x + place[0], "y": y + place[1], "duration": 20}])

    def middle(self, css):
        """The middle of an element in the window, scrolled there: WebDriver's own is that of the visible part."""
        return self.js(
            """const element = document.querySelector(arguments[0]);
            element.scrollIntoView({ block: "center", behavior: "instant" });
            const box = element.getBoundingClientRect();
            return [Math.round(box.x + box.width / 2), Math.round(box.y + box.height / 2)];""",
            css,
        )

    def keys(self, *names):
        """Presses keys one after the other; a tuple is pressed together."""
        steps = []
        for name in names:
            together = name if isinstance(name, tuple) else (name,)
            steps += [{"type": "keyDown", "value": key} for key in together]
            steps += [{"type": "keyUp", "value": key} for key in reversed(together)]
        self.actions("key", steps)

    def wait(self, code, what, limit=60):
        """Until the body of a function returns something true; gives that."""
        return until(lambda: self.js(code), limit, what)


def until(ready, limit, what):
    end = time.monotonic() + limit
    while True:
        if found := ready():
            return found
        if time.monotonic() > end:
            raise TimeoutError(f"{limit} s were not enough for {what}")
        time.sleep(0.05)


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


class Handler(http.server.SimpleHTTPRequestHandler):
    asked: list

    def log_message(self, *_):
        pass

    def do_GET(self):
        self.asked.append(self.path)
        super().do_GET()


class Host:
    """A static host of one folder. `asked` has the paths that were asked for."""

    def __init__(self, folder):
        self.asked = []
        handler = type("Asked", (Handler,), {"asked": self.asked})
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(handler, directory=folder))
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def close(self):
        self.server.shutdown()
        self.server.server_close()


if __name__ == "__main__":
    print(missing() or "nothing is missing")
    sys.exit(missing() is not None)
