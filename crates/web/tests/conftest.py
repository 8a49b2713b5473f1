"""Fixtures of the page that `make web` built, in headless Chromium.

SUNBEAM_WEB_SITE names another folder of the page.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import browser as browsers
import needs
import pytest

# pytest explains failed assertions of this module, too.
pytest.register_assert_rewrite("page")

from page import Page  # noqa: E402

REPOSITORY = Path(__file__).resolve().parents[3]
SITE = Path(os.environ.get("SUNBEAM_WEB_SITE", REPOSITORY / "target" / "web"))
# Folder of the page on its host; the page has to work from any.
PLACE = "some/where"


def pytest_sessionstart(session):
    if not (SITE / "index.html").exists():
        pytest.exit("the page is not built: run `make web` first", returncode=2)


@pytest.fixture(scope="session")
def host(tmp_path_factory):
    """A server of the page; `page` is the page's address."""
    if reason := browsers.missing():
        needs.skip("chromium", reason)
    root = tmp_path_factory.mktemp("host")
    (root / PLACE).parent.mkdir(parents=True)
    (root / PLACE).symlink_to(SITE.resolve())
    host = browsers.Host(root)
    host.page = f"{host.url}/{PLACE}/"
    yield host
    host.close()


@pytest.fixture(scope="module")
def window(host):
    """The page in a browser with WebGPU in software, one for each module of tests."""
    with browsers.Browser() as browser:
        yield Page(browser, host)


@pytest.fixture
def page(window):
    """The page for one test, which fails if the browser reports errors or warnings."""
    window.browser.resize(1400, 1000)
    window.browser.dark(False)
    shutil.rmtree(window.browser.downloads)
    window.browser.downloads.mkdir()
    yield window
    window.expect_no_errors()
