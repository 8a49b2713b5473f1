"""Names, order and line breaks in the generated text of pages."""

from docs.figures.page import named, scans_first
from docs.figures.wrap import COLUMNS, wrapped


def test_presets_of_skins_are_marked_as_procedural():
    assert named("elaphe") == "elaphe (procedural)"
    assert named("diffraction xenopeltis, bare") == "diffraction xenopeltis (procedural), bare"
    for measured in ("scan of xenopeltis", "scan-elaphe", "blazed", "cd"):
        assert named(measured) == measured


def test_scans_come_first_in_stable_order():
    assert scans_first(["cd", "blazed", "scan"]) == ["scan", "cd", "blazed"]
    assert scans_first({"b": 1, "scan of c": 2}.items()) == [("scan of c", 2), ("b", 1)]
    rows = [{"name": name} for name in ("z", "a", "scan")]
    assert [row["name"] for row in scans_first(rows, "name")] == ["scan", "z", "a"]


def test_paragraphs_and_list_items_are_filled():
    word = "word " * 40
    lines = wrapped(f"{word}\n\n- {word}\n  {word}\n- b").split("\n")
    assert max(len(line) for line in lines) <= COLUMNS
    assert [line[:6] for line in lines] == ["word w"] * 2 + [""] + ["- word"] + ["  word"] * 3 + ["- b"]


def test_tables_formulas_pictures_and_code_keep_their_lines():
    long = "x" * 130
    fence = f"```text\n{long} {long}\n- a\n```"
    kept = f"# {long}\n| {long} |\n| {long} |\n![{long}](a)\n\n{fence}\n$$ {long} $$\n<!-- {long} -->"
    assert wrapped(kept) == kept


def test_no_filled_line_begins_with_a_marker():
    text = " ".join(["word"] * 23) + " - dash and 2014. End # hash" * 12
    assert not any(line.startswith(("- ", "# ", "2014. ")) for line in wrapped(text).split("\n"))
