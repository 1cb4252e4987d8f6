# SPDX-License-Identifier: GPL-3.0-or-later
"""The contact sheet holds every picture, the right way up, and room for its words."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tools import contact_sheet
from tools.contact_sheet import CELL_WIDTH, Cell, Row
from tools.picture_file import read_picture, write_png


def half_and_half() -> np.ndarray:
    """Red above, green below; row 0 is at the bottom."""
    picture = np.zeros((60, 80, 3))
    picture[:30, :, 1] = 1.0
    picture[30:, :, 0] = 1.0
    return picture


def test_pictures_stand_in_their_cells_the_right_way_up(tmp_path: Path) -> None:
    write_png(tmp_path / "cell.png", half_and_half())
    rows = [
        Row("first", [Cell(half_and_half(), "a"), Cell(tmp_path / "cell.png", "b", "note")]),
        Row("second", [Cell(half_and_half(), "c")]),
    ]
    contact_sheet.write_sheet(tmp_path / "sheet.png", "Title", "subtitle", rows)
    sheet = read_picture(tmp_path / "sheet.png").rgb
    red = np.argwhere((sheet[..., 0] > 0.99) & (sheet[..., 1] < 0.01))
    green = np.argwhere((sheet[..., 1] > 0.99) & (sheet[..., 0] < 0.01))
    # Three pictures, half red and half green; resampling blends a row or two at the seam.
    half = CELL_WIDTH * CELL_WIDTH * 60 // 80 // 2
    assert 0.95 * 3 * half < len(red) <= 3 * half
    assert 0.95 * 3 * half < len(green) <= 3 * half
    assert red[:, 0].max() > green[:, 0].max()  # rows count upwards
    assert red[:, 0].min() > green[:, 0].min()
