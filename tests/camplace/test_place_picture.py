# SPDX-License-Identifier: GPL-3.0-or-later
"""The drawing of a placement."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from addon.camplace.place import place_cameras
from addon.camplace.settings import PlacementSettings
from addon.errors import InputError
from tests.synthetic import looking_at, perspective_view, room_with_box
from tools.place_picture import draw_placement

SETTINGS = PlacementSettings(
    view_samples=300, area_samples=300, grid_cells=24, candidates=4, secondaries=1
)


def test_the_picture_is_drawn(tmp_path: Path) -> None:
    view = perspective_view(looking_at((1.6, -1.7, 0.9), (-0.4, 0.9, -0.6)), 64, 48, 1.2)
    geometry = room_with_box()
    placement = place_cameras(geometry, (view,), SETTINGS)
    path = tmp_path / "placement.png"
    draw_placement(geometry, placement, path, (view,))
    picture = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert picture.shape[0] > 500
    red, green, blue = np.moveaxis(picture, -1, 0)
    assert ((green > red + 20) & (green > blue + 20)).sum() > 50  # covered samples
    assert ((blue > red + 60) & (blue > green + 30)).sum() > 50  # a cube camera


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    placement = place_cameras(room_with_box(), (), SETTINGS)
    with pytest.raises(InputError, match="cannot be written"):
        draw_placement(room_with_box(), placement, tmp_path / "missing" / "placement.png")
