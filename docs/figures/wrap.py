"""Paragraphs of Markdown filled to the column limit, so that templates need not count columns."""

from __future__ import annotations

import re
import textwrap

COLUMNS = 120
# The first line of a list item: its marker sets the indent of the lines that follow.
ITEM = re.compile(r"(?:- |\d+\. )")
# Tables, headings, comments and pictures, which a line break would destroy.
WHOLE_LINE = ("|", "#", "<!--", "![")
# A marker at the start of a line would begin a list, a quotation or a heading there.
MARKER = re.compile(r" (?=(?:[-+*>#=]+|\d+\.) )")
# A number and its unit.
QUANTITY = re.compile(r"(?<=\d) (?=(?:[µnmk]?m|[µmn]?s|[kMG]B|%)(?!\w))")
JOINT = "\0"


def wrapped(markdown: str) -> str:
    """The text with its paragraphs and list items filled up to `COLUMNS`.

    Tables, headings, comments, pictures, formulas and code stay as they are.
    """
    lines: list[str] = []
    paragraph: list[str] = []
    fence = ""
    for line in [*markdown.split("\n"), ""]:
        opens = "" if fence else next((marks for marks in ("```", "$$") if line.startswith(marks)), "")
        code = line.startswith("    ") and not paragraph
        breaks = fence or opens or code or not line or line.startswith(WHOLE_LINE)
        if paragraph and (breaks or ITEM.match(line)):
            lines += filled(paragraph)
            paragraph = []
        if not breaks:
            paragraph.append(line)
            continue
        lines.append(line)
        if opens and line.count(opens) == 1:
            fence = opens
        elif fence and line.rstrip().endswith(fence):
            fence = ""
    return "\n".join(lines[:-1])


def filled(paragraph: list[str]) -> list[str]:
    """The lines of one paragraph or list item, filled."""
    marker = ITEM.match(paragraph[0])
    indent = " " * len(marker[0]) if marker else ""
    words = " ".join(line.strip() for line in paragraph)
    first, rest = (marker[0], words[len(indent) :]) if marker else ("", words)
    found = textwrap.wrap(
        first + QUANTITY.sub(JOINT, MARKER.sub(JOINT, rest)),
        COLUMNS,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(JOINT, " ") for line in found]
