# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures that Blender did not write, or not all of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.errors import InputError
from addon.scene.temporary_render import render_to


@pytest.fixture
def scene(tmp_path: Path) -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.use_file_extension = False
    scene.render.filepath = str(tmp_path / "picture.exr")
    return scene


def add_camera(scene: Any) -> None:
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)


def test_a_whole_picture(scene: Any, tmp_path: Path) -> None:
    add_camera(scene)
    render_to(tmp_path / "picture.exr", 100, "a test")
    assert (tmp_path / "picture.exr").stat().st_size >= 100


def test_a_picture_that_blender_refuses(scene: Any, tmp_path: Path) -> None:
    (tmp_path / "picture.exr").write_bytes(bytes(1000))  # an earlier one is not taken for it
    with pytest.raises(InputError, match=r"nothing for a test \(.*camera.*\)"):
        render_to(tmp_path / "picture.exr", 100, "a test")


def test_a_picture_that_there_is_no_room_for(scene: Any, tmp_path: Path) -> None:
    add_camera(scene)
    with pytest.raises(InputError, match=f"{tmp_path.parent}, has no room for a test.*TMPDIR"):
        render_to(tmp_path / "picture.exr", 10**18, "a test")
