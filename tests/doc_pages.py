"""Parts of the Markdown pages: fenced blocks, headings and links."""

import re
from dataclasses import dataclass, field
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
SITE_PAGES = sorted((REPOSITORY / "docs").glob("*.md"))
#: Pages that registries show without the repository's other files.
PACKAGE_PAGES = [REPOSITORY / "python" / "README.md", REPOSITORY / "src" / "README.md"]
PAGES = [REPOSITORY / "README.md", *PACKAGE_PAGES, *SITE_PAGES]

# First line of a block, with its indentation, its backquotes and the word after them.
FENCE = re.compile(r"^(?P<indent>\s*)(?P<marks>`{3,})(?P<language>[^`]*)$")
# Instruction to the tests, a comment on the line before a block or before another instruction (docs/contributing.md).
COMMENT = re.compile(r"^\s*<!-- (?P<kind>not run|first): (?P<text>.*) -->\s*$")


@dataclass
class Block:
    """A fenced block, with the instructions of the comments before it."""

    #: File of the page.
    page: Path
    #: Number of the line that opens the block, from 1.
    line: int
    #: Word after the opening backquotes; empty without one.
    language: str
    #: Lines of the block without their common indentation.
    text: str = ""
    #: Reason why the block is not run; empty for a block that is.
    not_run: str = ""
    #: Shell commands run before the block and not shown on the page.
    first: list[str] = field(default_factory=list)

    def __str__(self):
        return f"{self.page.relative_to(REPOSITORY)}:{self.line}"


def split(page):
    """Splits a page into its blocks and its other lines with their numbers."""
    # `notes` are the comments that wait for their block, `fence` the line that opened the block being read.
    blocks, prose, notes, fence = [], [], [], None
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), start=1):
        if fence:
            if line.strip() == fence["marks"]:
                fence = None
            else:
                blocks[-1].text += line.removeprefix(fence["indent"]) + "\n"
        elif found := FENCE.match(line):
            fence = found
            block = Block(page, number, found["language"].strip())
            for note in notes:
                if note["kind"] == "first":
                    block.first.append(note["text"])
                else:
                    block.not_run = note["text"]
            blocks.append(block)
            notes = []
        elif comment := COMMENT.match(line):
            notes.append(comment)
        else:
            assert not notes, f"{page}:{number}: a comment for a block, but no block follows"
            prose.append((number, line))
    assert not fence, f"{page}: a block does not end"
    assert not notes, f"{page}: a comment for a block ends the page"
    return blocks, prose


def anchors(page):
    """Anchors of the page: its headings of up to four `#` as code hosts name them."""
    found = set()
    for _, line in split(page)[1]:
        if heading := re.match(r"#{1,4} (.*)", line):
            # Links become their text; backquotes and asterisks go.
            words = re.sub(r"\[([^]]*)\]\([^)]*\)|[`*]", lambda m: m[1] or "", heading[1]).strip().lower()
            found.add(re.sub(r"[^\w\- ]", "", words).replace(" ", "-"))
    return found


def links(page):
    """Yields the line number and the target of each link and picture of the page."""
    for number, line in split(page)[1]:
        # Code spans are removed, since brackets in them are no links.
        for target in re.findall(r"\]\(([^()\s]+)\)", re.sub(r"`[^`]*`", "", line)):
            yield number, target
