# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures for people: Blender's view transform, and false colours."""

from __future__ import annotations

import resource
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from addon.errors import InputError
from tools.display import correspondence_colors, write_display_png
from tools.metrics import encode_srgb
from tools.picture_file import read_picture


@pytest.fixture
def scene() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.view_settings.view_transform = "Standard"
    scene.render.dither_intensity = 0.0
    return scene


@pytest.fixture
def rgba() -> np.ndarray:
    picture = np.ones((20, 30, 4), dtype=np.float32)
    picture[..., :3] = np.random.default_rng(0).random((20, 30, 3)) * 1.2
    return picture


def test_the_standard_view_is_srgb(scene: Any, rgba: np.ndarray, tmp_path: Path) -> None:
    write_display_png(scene, rgba, tmp_path / "new" / "picture.png")
    found = read_picture(tmp_path / "new" / "picture.png").rgb
    # A level of rounding; Blender's table for the curve is good to a part of one.
    np.testing.assert_allclose(found * 255.0, encode_srgb(rgba[..., :3]) * 255.0, atol=1.0)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["picture.png"]


def test_exposure_and_view_are_the_scenes(scene: Any, rgba: np.ndarray, tmp_path: Path) -> None:
    scene.view_settings.exposure = -1.0
    write_display_png(scene, rgba, tmp_path / "dark.png")
    found = read_picture(tmp_path / "dark.png").rgb
    np.testing.assert_allclose(found * 255.0, encode_srgb(rgba[..., :3] / 2) * 255.0, atol=1.0)
    scene.view_settings.view_transform = "AgX"
    write_display_png(scene, rgba, tmp_path / "agx.png")
    assert np.abs(read_picture(tmp_path / "agx.png").rgb - found).max() > 0.05


def test_the_scenes_own_output_settings_stay(scene: Any, rgba: np.ndarray, tmp_path: Path) -> None:
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    write_display_png(scene, rgba, tmp_path / "picture.png")
    settings = scene.render.image_settings
    assert (settings.file_format, settings.color_depth) == ("OPEN_EXR", "32")
    assert len(bpy.data.images) == 0


def test_a_place_that_cannot_be_written_is_named(
    scene: Any, rgba: np.ndarray, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError, match=r"folder\.png cannot be written"):
        write_display_png(scene, rgba, tmp_path / "folder.png")
    with pytest.raises(InputError, match="file cannot be made"):
        write_display_png(scene, rgba, tmp_path / "file" / "picture.png")


def test_a_full_disk_leaves_nothing_half_written(
    scene: Any, rgba: np.ndarray, tmp_path: Path
) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    # Files of this process end at 1 kB: what a full disk does, without filling one.
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, limits[1]))
    try:
        with pytest.raises(InputError, match=r"picture\.png cannot be written"):
            write_display_png(scene, rgba, tmp_path / "picture.png")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert list(tmp_path.iterdir()) == []


def test_holes_are_white_and_cameras_have_their_own_hues() -> None:
    cameras = np.arange(-1, 12, dtype=np.float32)
    correspondence = np.zeros((1, 13, 4), dtype=np.float32)
    correspondence[0, :, 0] = cameras
    colors = correspondence_colors(correspondence)[0]
    np.testing.assert_array_equal(colors[0], 1.0)
    distance = np.abs(colors[:, None] - colors[None]).sum(axis=-1)
    assert distance[~np.eye(13, dtype=bool)].min() > 0.1
    assert (colors >= 0.0).all()
    assert (colors <= 1.0).all()
