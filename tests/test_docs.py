"""The documentation: snippets, links, named files, the site, and tables of parameters and rooms."""

import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from xml.etree import ElementTree

import doc_pages
import needs
import pytest
import run_page
import yaml
from doc_pages import PACKAGE_PAGES, PAGES, REPOSITORY, SITE_PAGES

from docs.figures.wrap import COLUMNS

TOOL = REPOSITORY / "target" / "release"
# Languages of blocks that are not run: output, and directives of the site.
SHOWN = {"text", "{toctree}"}
# Commands that need a GPU adapter.
NEEDS_ADAPTER = re.compile(r"sunbeam (adapter|render|view)\b|--backend gpu")
# Files that a command writes and the repository may lack.
WRITTEN_LATER = {"docs/data/gpu.json"}
EXAMPLES = sorted((REPOSITORY / "examples").glob("*.py"))


def environment():
    """The environment of a user in a checkout after `make plugin`, `make tool` and `make library`."""
    return {
        **{name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS")},
        "PATH": os.pathsep.join([str(TOOL), str(Path(sys.executable).parent), os.environ["PATH"]]),
        "PYTHONPATH": os.pathsep.join([str(REPOSITORY / "python"), str(REPOSITORY)]),
        "MPLBACKEND": "Agg",
        "SUNBEAM_CACHE": "on",
    }


@pytest.fixture
def folder(tmp_path):
    """A folder with a link to the checkout's `target`."""
    for name, built in [("sunbeam", "tool"), ("c_abi", "library")]:
        if not (TOOL / name).exists() and not (TOOL.parent / name).exists():
            pytest.exit(f"target/{name} is not built: run `make {built}` first", returncode=2)
    (tmp_path / "target").symlink_to(REPOSITORY / "target")
    return tmp_path


@lru_cache
def has_adapter():
    with tempfile.TemporaryDirectory() as folder:
        words = ["render", "--method", "stam", "--preset", "blazed", "--size", "8x8", "-o", f"{folder}/a.exr"]
        done = subprocess.run([TOOL / "sunbeam", *words], capture_output=True, text=True)
    if "no usable GPU adapter" in done.stderr:
        needs.miss("gpu", "documentation that draws", done.stderr.strip())
        return False
    return True


def run(words, folder):
    done = subprocess.run(
        words, cwd=folder, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=900
    )
    assert done.returncode == 0, done.stdout[-8000:]
    return done.stdout


def name(page):
    """Test id of a page: its path without `docs/`."""
    return str(page.relative_to(REPOSITORY)).removeprefix("docs/")


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_blocks_run(page, folder):
    steps = []
    for block in doc_pages.split(page)[0]:
        language = block.language
        assert language in SHOWN or language in run_page.KINDS, f"{block}: a block of the unknown language {language!r}"
        steps += [("sh", block.line, text) for text in block.first]
        if block.not_run or (NEEDS_ADAPTER.search(block.text) and not has_adapter()):
            assert language not in SHOWN, f"{block}: nobody would run it"
            check_what_is_not_run(block)
        elif language not in SHOWN:
            steps.append((language, block.line, block.text))
    if steps:
        task = folder / ".steps.json"
        task.write_text(json.dumps({"page": str(page.relative_to(REPOSITORY)), "steps": steps}))
        run([sys.executable, REPOSITORY / "tests" / "run_page.py", task], folder)


def check_what_is_not_run(block):
    """Checks a block without running it: Make's targets and the command's options exist, and code parses."""
    if block.language == "python":
        compile(block.text, str(block), "exec")
    elif block.language == "xml":
        ElementTree.fromstring(block.text)
    elif block.language in ("sh", "console"):
        lines = block.text.splitlines()
        if block.language == "console":
            lines = [line for command, _ in run_page.commands(block.text) for line in command.splitlines()]
        for line in lines:
            for words in simple_commands(line):
                check_command(words, block)


def simple_commands(line):
    """The words of each command in a line of shell."""
    lexer = shlex.shlex(line, posix=True, punctuation_chars="|&;")
    lexer.whitespace_split = True
    words = []
    for word in [*lexer, ";"]:
        if set(word) <= set("|&;"):
            # Variables set for the command alone are dropped.
            while words and re.match(r"[A-Z_]+=", words[0]):
                words.pop(0)
            if words:
                yield words
            words = []
        else:
            words.append(word)


@lru_cache
def help_of(command):
    return subprocess.run(
        [TOOL / "sunbeam", command, "--help"], capture_output=True, text=True, check=True, env=environment()
    ).stdout


def check_command(words, block):
    name, *arguments = words
    if name == "make":
        done = subprocess.run(
            ["make", "-n", *arguments], cwd=REPOSITORY, capture_output=True, text=True, env=environment()
        )
        assert done.returncode == 0, f"{block}: {done.stderr}"
    elif Path(name).name == "sunbeam":
        for option in re.findall(r"(?:^| )(--?[a-zA-Z][a-z-]*)", " ".join(arguments[1:])):
            assert re.search(rf"(^|[ ,]){option}\b(?!-)", help_of(arguments[0]), re.M), (
                f"{block}: sunbeam {arguments[0]} has no {option}"
            )


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page):
    broken = []
    for number, target in doc_pages.links(page):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path) if path else page
        if not file.exists():
            broken.append(f"{page.name}:{number}: there is no {path}")
        elif anchor and file.suffix == ".md" and anchor not in doc_pages.anchors(file):
            broken.append(f"{page.name}:{number}: {file.name} has no heading for #{anchor}")
    assert not broken, "\n".join(broken)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_lines_of_prose_end_at_120_columns(page):
    long = [f"{number}: {line}" for number, line in doc_pages.split(page)[1] if len(line) > COLUMNS]
    # Tables, pictures, headings and addresses have no place for a line break.
    assert [line for line in long if not re.match(r"\d+: (\||!\[|#|\S{100})", line)] == []


@pytest.mark.parametrize("page", PACKAGE_PAGES, ids=name)
def test_package_pages_have_no_relative_links(page):
    relative = [f"line {number}: {target}" for number, target in doc_pages.links(page) if ":" not in target]
    assert not relative, f"{page} links to what its readers do not have: {relative}"


@pytest.mark.parametrize("page", ["architecture.md", "contributing.md"])
def test_named_files_and_folders_exist(page):
    """Paths in backquotes that begin with a folder of the repository; `NAME` and `*` stand for any name."""
    folders = {path.name for path in REPOSITORY.iterdir() if path.is_dir()} - {"out", "target"}
    prose = "\n".join(line for _, line in doc_pages.split(REPOSITORY / "docs" / page)[1])
    named = [path for path in re.findall(r"`([^`\s]+/[^`\s]*)`", prose) if path.split("/")[0] in folders]
    assert len(named) > 20
    missing = [path for path in named if not any(REPOSITORY.glob(path.rstrip("/").replace("NAME", "*")))]
    assert set(missing) <= WRITTEN_LATER, f"{page} names what is not there: {missing}"


def test_named_functions_are_in_their_files():
    """Phrases of the form `name` in `file` of contributing.md."""
    page = (REPOSITORY / "docs" / "contributing.md").read_text(encoding="utf-8")
    named = re.findall(r"`(\w+)` in\s`([^`\s]+\.\w+)`", page)
    assert {"obliquity", "pair_obliquity"} <= {function for function, _ in named}
    for function, file in named:
        assert re.search(rf"\b{function}\b", (REPOSITORY / file).read_text(encoding="utf-8")), (function, file)


def test_rooms_depend_on_rooms_above_them():
    """The table of rooms in architecture.md against the imports of the sources, comments left aside."""
    page = (REPOSITORY / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `src/(\w+)/` \| [^|]* \| ([^|]*) ?\|$", page, re.M)
    rooms = [room for room, _ in rows]
    assert set(rooms) == {path.name for path in (REPOSITORY / "src").iterdir() if path.is_dir()}
    for place, (room, cell) in enumerate(rows):
        said = set(re.findall(r"`(\w+)`", cell)) - {"height_field"}
        used = set()
        for file in (REPOSITORY / "src" / room).rglob("*.rs"):
            code = re.sub(r"//.*", "", file.read_text(encoding="utf-8"))
            used |= {name for name in re.findall(r"\bcrate::(\w+)", code) if name in rooms and name != room}
        assert used <= said, f"src/{room} also depends on {sorted(used - said)}, which the page does not say"
        assert said <= set(rooms[:place]), f"src/{room} depends on a room below it"


def test_the_citation_has_the_version_of_the_crate():
    citation = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text(encoding="utf-8"))
    crate = re.search(r'^version = "(.*)"', (REPOSITORY / "Cargo.toml").read_text(encoding="utf-8"), re.M)[1]
    assert citation["version"] == crate
    assert {"cff-version", "message", "title", "authors"} <= set(citation), "a field that the format demands is missing"
    assert all({"type", "title", "authors"} <= set(reference) for reference in citation["references"])


def test_site_builds(tmp_path):
    """Sphinx builds the site without a warning, and every page is in the contents."""
    words = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", tmp_path / "doctrees"]
    run([*words, REPOSITORY / "docs", tmp_path / "site"], tmp_path)
    contents = (tmp_path / "site" / "index.html").read_text(encoding="utf-8")
    for page in SITE_PAGES:
        assert (tmp_path / "site" / f"{page.stem}.html").exists()
        assert f'href="{page.stem}.html"' in contents or page.stem == "index", f"{page.stem} is not in the contents"


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.stem)
def test_example_runs(example, folder):
    run([sys.executable, example], folder)


def test_the_notebook_page_shows_the_example():
    """The page has each cell of the example."""
    example = (REPOSITORY / "examples" / "brdf_map_and_render.py").read_text(encoding="utf-8")
    cells = [
        re.sub(r"\A[^\n]*\n(?:#[^\n]*\n)*", "", cell).strip() for cell in re.split(r"^# %%", example, flags=re.M)[1:]
    ]
    shown = [block.text.strip() for block in doc_pages.split(REPOSITORY / "docs" / "python.md")[0]]
    for cell in filter(None, cells):
        assert cell in shown, cell


def test_parameters_are_documented():
    """plugin.md and the plugin's manual name exactly the plugin's parameters."""
    source = (REPOSITORY / "cpp_shim/parameters.cpp").read_text(encoding="utf-8")
    literals = re.search(r"ALL_NAMES =\s*((?:\"[^\"]*\"\s*)+);", source)[1]
    names = "".join(re.findall(r'"([^"]*)"', literals)).split(", ")
    page = (REPOSITORY / "docs" / "plugin.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ((?:`[a-z_]+`(?:, )?)+) \|", page, re.M)
    documented = [name for row in rows for name in re.findall(r"`([a-z_]+)`", row)]
    assert sorted(documented) == sorted(names)
    manual = (REPOSITORY / "cpp_shim/diffraction.cpp").read_text(encoding="utf-8").split("Model\n")[0]
    for name in names:
        assert re.search(rf"^ \* (?:\w+, )*{name}\b", manual, re.M), f"the plugin's own manual lacks {name}"


def test_exposed_parameters_are_marked(scalar_rgb, make_bsdf):
    """plugin.md marks the parameters that `mi.traverse` shows."""
    import mitsuba as mi

    everything = make_bsdf(preset="flat", eta=1.5, k=0.1, diffuse_reflectance=0.5, conserve_energy=False, tolerance=0.1)
    film = make_bsdf(preset="flat", eta=1.5, transmission="film")
    exposed = {key.split(".")[0] for bsdf in (everything, film) for key in mi.traverse(bsdf).keys()}  # noqa: SIM118
    page = (REPOSITORY / "docs" / "plugin.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ((?:`[a-z_]+`(?:, )?)+) \|.*\\?\|exposed\\?\|", page, re.M)
    assert {name for row in rows for name in re.findall(r"`([a-z_]+)`", row)} == exposed


@pytest.mark.parametrize(
    ("shown", "found"),
    [
        ('  "mean_nm": 2500.1,', '  "mean_nm": 2510.1,'),
        ('  "mean_nm": 2500.1,', '  "median_nm": 2500.1,'),
        ("a\nb", "a"),
        ("a", "a\nb"),
    ],
)
def test_stale_output_is_noticed(shown, found):
    with pytest.raises(AssertionError):
        run_page.compare(shown.splitlines(), found)


def test_rounding_times_and_omissions_are_accepted():
    run_page.compare(["0.30000000000000004", '"seconds": 2.5,', "…"], '0.3\n"seconds": 7.1,\nmore\nand more')


@pytest.mark.parametrize(
    "line",
    [
        "make no-such-target",
        "cd x && sunbeam eval --no-such-option 3",
        "SUNBEAM_CACHE=off sunbeam eval --preset flat | sunbeam sample --size 3",
        "sunbeam no-such-command --preset flat",
    ],
)
def test_stale_commands_are_noticed(line):
    block = doc_pages.Block(REPOSITORY / "README.md", 1, "sh", line)
    with pytest.raises((AssertionError, subprocess.CalledProcessError)):
        check_what_is_not_run(block)


def test_stale_snippets_and_links_are_noticed(folder):
    page = folder / "page.md"
    page.write_text(
        "# A heading\n\n```python\nassert 1 == 2\n```\n\n[a](#a-heading) [b](#another) [c](no-such-file.md)\n"
    )
    assert doc_pages.anchors(page) == {"a-heading"}
    assert [target for _, target in doc_pages.links(page)] == ["#a-heading", "#another", "no-such-file.md"]
    task = folder / ".steps.json"
    steps = [(block.language, block.line, block.text) for block in doc_pages.split(page)[0]]
    task.write_text(json.dumps({"page": "page.md", "steps": steps}))
    with pytest.raises(AssertionError, match=r"page\.md.*assert 1 == 2"):
        run([sys.executable, REPOSITORY / "tests" / "run_page.py", task], folder)
