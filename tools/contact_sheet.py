# SPDX-License-Identifier: GPL-3.0-or-later
"""One picture that shows all the others, with labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .picture_file import write_png

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageFont import FreeTypeFont, ImageFont

    Font = FreeTypeFont | ImageFont

CELL_WIDTH = 400
GAP = 14
LABEL, SMALL, TITLE = 20, 17, 32
PAPER, INK, PALE = (24, 25, 28), (236, 236, 232), (168, 170, 174)


@dataclass(frozen=True)
class Cell:
    """One labelled picture.

    Attributes:
        picture: a PNG file, or display-encoded values in [0, 1], (H, W, 3), row 0 at the bottom.
        label: what it shows.
        note: a second, paler line; figures.
        span: how many columns wide it is.
    """

    picture: Path | NDArray[np.floating]
    label: str
    note: str = ""
    span: int = 1

    def width(self, column: int = CELL_WIDTH) -> int:
        """Pixels on a sheet with `column` pixels a column, with the gaps between its columns."""
        return self.span * (column + GAP) - GAP


@dataclass(frozen=True)
class Row:
    """Cells side by side under a heading."""

    heading: str
    cells: Sequence[Cell]


def draw_sheet(
    title: str, subtitle: str, rows: Sequence[Row], *, column: int = CELL_WIDTH
) -> Image:
    """All rows under one title; a column is `column` pixels wide, whatever its pictures' size."""
    from PIL import Image, ImageDraw

    columns = max(sum(cell.span for cell in row.cells) for row in rows)
    width = columns * (column + GAP) + GAP
    pictures = [[_load(cell, cell.width(column)) for cell in row.cells] for row in rows]
    heights = [max(picture.height for picture in row) for row in pictures]
    text = LABEL + SMALL + 14
    top = 3 * GAP + TITLE + SMALL if title else 0
    headings = [LABEL + GAP if row.heading else GAP for row in rows]
    each = [
        heading + GAP + height + text for heading, height in zip(headings, heights, strict=True)
    ]
    sheet = Image.new("RGB", (width, top + sum(each) + GAP), PAPER)
    draw = ImageDraw.Draw(sheet)
    draw.text((GAP, GAP), title, INK, font=_font(TITLE))
    draw.text((GAP, 2 * GAP + TITLE), subtitle, PALE, font=_font(SMALL))
    y = top
    for row, row_pictures, height, heading, step in zip(
        rows, pictures, heights, headings, each, strict=True
    ):
        draw.text((GAP, y), row.heading, INK, font=_font(LABEL))
        x = GAP
        for cell, picture in zip(row.cells, row_pictures, strict=True):
            sheet.paste(picture, (x, y + heading))
            below = y + heading + height + 4
            draw.text((x, below), cell.label, INK, font=_font(LABEL - 2))
            draw.text((x, below + LABEL + 2), cell.note, PALE, font=_font(SMALL - 2))
            x += cell.width(column) + GAP
        y += step
    return sheet


def write_sheet(
    path: Path, title: str, subtitle: str, rows: Sequence[Row], *, column: int = CELL_WIDTH
) -> None:
    """Draw the sheet into a PNG file. Raises InputError when it cannot be written."""
    sheet = np.asarray(draw_sheet(title, subtitle, rows, column=column), dtype=np.float32)
    write_png(path, sheet[::-1] / 255.0)


def _load(cell: Cell, width: int) -> Image:
    """The cell's picture, `width` pixels wide."""
    from PIL import Image

    if isinstance(cell.picture, Path):
        with Image.open(cell.picture) as file:
            image = file.convert("RGB")
    else:
        encoded = np.clip(np.asarray(cell.picture, dtype=np.float64)[::-1], 0.0, 1.0)
        image = Image.fromarray(np.rint(encoded * 255.0).astype(np.uint8))
    height = round(image.height * width / image.width)
    return image.resize((width, height), Image.Resampling.LANCZOS)


def _font(size: int) -> Font:
    """Pillow's own font: no machine lacks it."""
    from PIL import ImageFont

    return ImageFont.load_default(size)
