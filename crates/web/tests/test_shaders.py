"""Every WGSL program of the realtime renderer in the browser's own compiler, which is stricter than naga."""

from __future__ import annotations

import json
import subprocess

import pytest
from conftest import REPOSITORY

# naga accepts these operators without parentheses, and the grammar of WGSL does not (section 8.18).
MIXED_OPERATORS = [
    ("(pixel.y << 16u) | pixel.x", "pixel.y << 16u | pixel.x"),
    ("((skin >> i) & 1u) != 0u", "(skin >> i & 1u) != 0u"),
]


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """Sources by name."""
    path = tmp_path_factory.mktemp("programs") / "programs.json"
    twin = REPOSITORY / "target" / "release" / "examples" / "page_twin"
    subprocess.run([twin, "--programs", "-o", path], check=True, timeout=300)
    return json.loads(path.read_text())


def errors(page, source):
    """The compiler's errors."""
    return page.browser.promise(
        """window.shaders ??= await (await navigator.gpu.requestAdapter()).requestDevice();
        shaders.pushErrorScope("validation");
        const { messages } = await shaders.createShaderModule({ code: args[0] }).getCompilationInfo();
        await shaders.popErrorScope();
        const errors = messages.filter(({ type }) => type === "error");
        return errors.map(({ lineNum, message }) => `${lineNum}: ${message}`);""",
        source,
    )


def test_the_browser_compiles_every_program(page, programs):
    page.reopen()
    assert {"shade, grating", "shade, stam of GPU Gems", "locate"} <= set(programs)
    for name, source in programs.items():
        assert errors(page, source) == [], name
    page.browser.console()


@pytest.mark.parametrize(("right", "wrong"), MIXED_OPERATORS)
def test_the_browser_refuses_mixed_operators(page, programs, right, wrong):
    page.reopen()
    source = programs["locate"]
    assert right in source
    assert errors(page, source.replace(right, wrong))
    # The browser's warning about the refused program.
    page.browser.console()
