"""Fills paragraphs of Markdown to the column limit, so that templates need not count columns."""

from __future__ import annotations

import re
import textwrap

# Largest length of a filled line in characters.
COLUMNS = 120
# Marker of a list item; further lines of the item are indented by its length.
ITEM = re.compile(r"(?:- |\d+\. )")
# Beginnings of tables, headings, comments and pictures, which a line break would destroy.
WHOLE_LINE = ("|", "#", "<!--", "![")
# Space before a marker that at the start of a line would begin a list, a quotation or a heading.
BEFORE_MARKER = re.compile(r" (?=(?:[-+*>#=]+|\d+\.) )")
# Space between a number and its unit.
BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:[µnmk]?m|[µmn]?s|[kMG]B|%)(?!\w))")
# Stands for a space at which no line may be broken.
NO_BREAK = "\0"


def wrapped(markdown: str) -> str:
    """The text with its paragraphs and list items filled up to COLUMNS.

    Tables, headings, comments, pictures, formulas and code keep their lines. Lists must not be nested.
    """
    lines: list[str] = []
    # Lines of the paragraph or list item that is being read.
    paragraph: list[str] = []
    # Marks of the open block of code or formula, empty outside of one.
    fence = ""
    # An empty line at the end completes the last paragraph; it is removed again.
    for line in [*markdown.split("\n"), ""]:
        opens = "" if fence else next((marks for marks in ("```", "$$") if line.startswith(marks)), "")
        is_code = line.startswith("    ") and not paragraph
        is_kept = fence or opens or is_code or not line or line.startswith(WHOLE_LINE)
        if paragraph and (is_kept or ITEM.match(line)):
            lines += filled(paragraph)
            paragraph = []
        if not is_kept:
            paragraph.append(line)
            continue
        lines.append(line)
        # A block that also ends in its first line, such as a formula, stays closed.
        if opens and line.count(opens) == 1:
            fence = opens
        elif fence and line.rstrip().endswith(fence):
            fence = ""
    return "\n".join(lines[:-1])


def filled(paragraph: list[str]) -> list[str]:
    """The lines of one paragraph or list item, filled; all lines of a list item but the first are indented."""
    marker = ITEM.match(paragraph[0])
    first = marker[0] if marker else ""
    rest = " ".join(line.strip() for line in paragraph)[len(first) :]
    lines = textwrap.wrap(
        first + BEFORE_UNIT.sub(NO_BREAK, BEFORE_MARKER.sub(NO_BREAK, rest)),
        COLUMNS,
        subsequent_indent=" " * len(first),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(NO_BREAK, " ") for line in lines]
