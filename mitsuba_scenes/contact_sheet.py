"""Contact sheet: one PNG with rows of scaled pictures and a caption below each. All lengths are in pixels."""

from __future__ import annotations

from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

# Space around and between the pictures.
MARGIN = 10
# Size of the default font.
FONT_SIZE = 15
# Height of the space for a caption of one line.
CAPTION_HEIGHT = 26
# Further height per additional line of a caption.
LINE_HEIGHT = 16
# Offset of a caption, right and down, from the bottom left corner of its picture.
CAPTION_OFFSET = (2, 4)
# Background, sRGB bytes.
PAPER = (22, 22, 24)
# Colour of the captions, sRGB bytes.
INK = (225, 225, 220)


def contact_sheet(
    rows: list[list[tuple[Path, str]]], output: Path, width: int = 384, font: ImageFont.ImageFont | None = None
) -> None:
    """Writes rows of (picture file, caption) to `output`, from the top left. Rows may differ in length; none is empty.

    Every picture is scaled to `width` and to the proportions of the first one. Captions may have several lines; all
    rows leave space for the caption with the most lines. The default font, Pillow's own, has neither Greek letters nor
    µ.
    """
    with Image.open(rows[0][0][0]) as first:
        height = round(width * first.height / first.width)
    # Lines of the longest caption beyond its first.
    extra_lines = max(caption.count("\n") for row in rows for _, caption in row)
    caption_height = CAPTION_HEIGHT + LINE_HEIGHT * extra_lines
    columns = max(len(row) for row in rows)
    size = (MARGIN + columns * (width + MARGIN), MARGIN + len(rows) * (height + caption_height + MARGIN))
    sheet = Image.new("RGB", size, PAPER)
    draw = ImageDraw.Draw(sheet)
    font = font or ImageFont.load_default(size=FONT_SIZE)
    for i, row in enumerate(rows):
        for j, (path, caption) in enumerate(row):
            x, y = MARGIN + j * (width + MARGIN), MARGIN + i * (height + caption_height + MARGIN)
            with Image.open(path) as picture:
                sheet.paste(picture.convert("RGB").resize((width, height), Image.Resampling.LANCZOS), (x, y))
            draw.text((x + CAPTION_OFFSET[0], y + height + CAPTION_OFFSET[1]), caption, fill=INK, font=font)
    sheet.save(output)
