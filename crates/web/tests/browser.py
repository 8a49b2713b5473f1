"""Headless Chromium with WebGPU in software, driven by Selenium, and a static file server."""

from __future__ import annotations

import bisect
import contextlib
import functools
import http.server
import json
import math
import shutil
import sys
import tempfile
import threading
from pathlib import Path

from selenium import webdriver
from selenium.common.exceptions import WebDriverException
from selenium.webdriver import ActionChains
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions.interaction import POINTER_TOUCH
from selenium.webdriver.common.actions.wheel_input import ScrollOrigin
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

# Names of Chromium's program.
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
# Chromium's flags in all tests.
BASE = (
    "--headless=new",
    "--no-sandbox",
    "--no-first-run",
    "--disable-background-networking",
    # A page in this cache keeps its workers and its memory.
    "--disable-features=BackForwardCache",
    "--disable-component-update",
    "--disable-dev-shm-usage",
    "--disable-sync",
    # Makes colours independent of the screen, since tests compare them.
    "--force-color-profile=srgb",
)
# Flags for WebGPU in software. With the first one alone, drawing on a canvas loses the device.
WEBGPU = (
    "--enable-unsafe-webgpu",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
# Flags that record the tasks of all threads from the browser's start to its end. chromedriver's own log ends after
# 100 000 lines.
TRACE = (
    "--trace-startup=toplevel,blink.user_timing",
    "--trace-startup-duration=0",
    "--trace-startup-format=json",
    "--trace-startup-owner=controller",
)


def missing() -> str | None:
    """Message about a program that the tests need and that is not installed; `None` if all are."""
    if not any(shutil.which(name) for name in BROWSERS):
        return "Chromium is not installed (on Debian: apt-get install chromium chromium-driver)"
    if not shutil.which("chromedriver"):
        return "chromedriver is not installed (on Debian: apt-get install chromium-driver)"
    return None


class Browser:
    """One window of headless Chromium; `driver` is Selenium's driver of it.

    `flags` are added to BASE, `size` is the page's width and height in CSS pixels, and `traced` records the tasks for
    `task_ms`.
    """

    def __init__(self, flags=WEBGPU, size=(1400, 1000), traced=False):
        self.folder = Path(tempfile.mkdtemp(prefix="sunbeam-browser-"))
        self.downloads = self.folder / "downloads"
        self.downloads.mkdir()
        self.trace = self.folder / "trace.json"
        options = webdriver.ChromeOptions()
        options.binary_location = next(path for path in map(shutil.which, BROWSERS) if path)
        arguments = [
            *BASE,
            *flags,
            *((*TRACE, f"--trace-startup-file={self.trace}") if traced else ()),
            f"--window-size={size[0]},{size[1]}",
            f"--user-data-dir={self.folder / 'profile'}",
        ]
        for argument in arguments:
            options.add_argument(argument)
        options.add_experimental_option(
            "prefs", {"download.default_directory": str(self.downloads), "download.prompt_for_download": False}
        )
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        service = webdriver.ChromeService(shutil.which("chromedriver"))
        self.driver = webdriver.Chrome(options, service)
        try:
            self.driver.set_script_timeout(240)
            self.driver.set_page_load_timeout(60)
            self.version = f"Chromium {self.driver.capabilities['browserVersion']}"
            # The window's size includes the window's frame.
            self.resize(*size)
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Ends the browser and chromedriver; the browser may have ended already."""
        with contextlib.suppress(WebDriverException):
            self.driver.quit()
        shutil.rmtree(self.folder, ignore_errors=True)

    def devtools(self, command, **parameters):
        """Executes a command of the Chrome DevTools protocol."""
        return self.driver.execute_cdp_cmd(command, parameters)

    def resize(self, width, height, scale=1):
        """Sets the page's size in CSS pixels, and the device's pixels for each of them."""
        self.devtools(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=False
        )

    def dark(self, on=True):
        """Selects the dark colour scheme, or the light one."""
        features = [{"name": "prefers-color-scheme", "value": "dark" if on else "light"}]
        self.devtools("Emulation.setEmulatedMedia", features=features)

    def go(self, url):
        self.driver.get(url)

    def js(self, code, *arguments):
        """The value that `code` returns, the body of a function whose arguments are `arguments`."""
        return self.driver.execute_script(code, *arguments)

    def promise(self, code, *arguments):
        """The value that `code` returns, the body of an asynchronous function whose arguments are `args`."""
        script = f"""
            const done = arguments[arguments.length - 1];
            (async (...args) => {{ {code} }})(...arguments).then(
                (value) => done({{ value: value ?? null }}), (error) => done({{ error: String(error) }}));"""
        found = self.driver.execute_async_script(script, *arguments)
        if "error" in found:
            raise WebDriverException(found["error"])
        return found["value"]

    def element(self, css):
        return self.driver.find_element(By.CSS_SELECTOR, css)

    def click(self, css):
        self.element(css).click()

    def type(self, css, text):
        self.element(css).send_keys(text)

    def screenshot(self):
        """The visible part of the page, as a PNG file."""
        return self.driver.get_screenshot_as_png()

    def console(self):
        """Console messages since the last call, as [level, text]."""
        return [[entry["level"], entry["message"]] for entry in self.driver.get_log("browser")]

    def task_ms(self, mark):
        """Processor time in ms of each task of the page's own thread that began after the page had set this mark.

        The browser has to be `traced`, and this call ends it. Tasks in which chromedriver's messages arrive are left
        out.
        """
        # The browser writes the trace when it ends, and chromedriver would not wait for that.
        with contextlib.suppress(WebDriverException):
            self.devtools("Browser.close")
        events = until(self.traced_events, 120, "the trace")
        # Times of the mark by thread; other threads than the page's have none.
        marks = {(event["pid"], event["tid"]): event["ts"] for event in events if event["name"] == mark}
        events = [event for event in events if event["ts"] > marks.get((event["pid"], event["tid"]), math.inf)]
        # Times of chromedriver's messages.
        driven = sorted(event["ts"] for event in events if "blink.mojom.DevTools" in json.dumps(event.get("args")))
        tasks = [event for event in events if event["name"].endswith("RunTask") and "tdur" in event]
        return [
            task["tdur"] / 1e3
            for task in tasks
            # No message arrives between the task's ends.
            if bisect.bisect_left(driven, task["ts"]) == bisect.bisect_right(driven, task["ts"] + task["dur"])
        ]

    def traced_events(self):
        """The events of the trace; `None` until it is written completely."""
        with contextlib.suppress(FileNotFoundError, json.JSONDecodeError):
            return json.loads(self.trace.read_text())["traceEvents"]

    def drag(self, css, start, way, button=0, steps=4):
        """Drags the mouse from `start` by `way`, both in pixels; `start` is relative to the element's middle."""
        x, y = self.middle(css)
        actions = ActionBuilder(self.driver, duration=20)
        mouse = actions.pointer_action
        mouse.move_to_location(x + start[0], y + start[1])
        mouse.pointer_down(button)
        for step in range(1, steps + 1):
            mouse.move_to_location(
                round(x + start[0] + way[0] * step / steps), round(y + start[1] + way[1] * step / steps)
            )
        mouse.pointer_up(button)
        actions.perform()

    def hover(self, css, place):
        """Moves the mouse to a point of the element, in pixels from its middle."""
        x, y = self.middle(css)
        actions = ActionBuilder(self.driver, duration=20)
        actions.pointer_action.move_to_location(x + place[0], y + place[1])
        actions.perform()

    def wheel(self, css, pixels):
        """Turns the mouse wheel over the middle of the element; negative is away from the user."""
        origin = ScrollOrigin.from_viewport(*self.middle(css))
        ActionChains(self.driver, duration=0).scroll_from_origin(origin, 0, pixels).perform()

    def fingers(self, *paths):
        """Moves one finger along each path, a list of points (x, y) of the window, all at the same time."""
        actions = ActionBuilder(self.driver)
        for index, (start, *others) in enumerate(paths):
            finger = actions.add_pointer_input(POINTER_TOUCH, f"finger {index}")
            finger.create_pointer_move(duration=30, x=start[0], y=start[1])
            finger.create_pointer_down(button=0)
            for x, y in others:
                finger.create_pointer_move(duration=30, x=x, y=y)
            finger.create_pointer_up(0)
        actions.perform()

    def middle(self, css):
        """The middle of an element in window pixels, after scrolling to it; Selenium's is that of the visible part."""
        return self.js(
            """const element = document.querySelector(arguments[0]);
            element.scrollIntoView({ block: "center", behavior: "instant" });
            const box = element.getBoundingClientRect();
            return [Math.round(box.x + box.width / 2), Math.round(box.y + box.height / 2)];""",
            css,
        )

    def keys(self, *names):
        """Presses keys one after the other; the keys of a tuple are pressed together."""
        actions = ActionChains(self.driver)
        for name in names:
            together = name if isinstance(name, tuple) else (name,)
            for key in together:
                actions.key_down(key)
            for key in reversed(together):
                actions.key_up(key)
        actions.perform()

    def wait(self, code, awaited, limit=60):
        """Waits until `js` of `code` returns a true value, and returns it; `awaited` names it if `limit` s pass."""
        return until(lambda: self.js(code), limit, awaited)


def until(ready, limit, awaited):
    """Waits at most `limit` seconds until `ready` returns a true value, and returns it; errors name `awaited`."""
    waiting = WebDriverWait(None, limit, poll_frequency=0.05)
    return waiting.until(lambda _: ready(), f"{limit} s were not enough for {awaited}")


class Handler(http.server.SimpleHTTPRequestHandler):
    """Serves files and records the requested paths."""

    requested: list

    def log_message(self, *_):
        pass

    def do_GET(self):
        self.requested.append(self.path)
        super().do_GET()


class Host:
    """A static file server of one folder. `requested` lists the requested paths."""

    def __init__(self, folder):
        self.requested = []
        handler = type("Recorder", (Handler,), {"requested": self.requested})
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(handler, directory=folder))
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def close(self):
        self.server.shutdown()
        self.server.server_close()


if __name__ == "__main__":
    print(missing() or "nothing is missing")
    sys.exit(missing() is not None)
