# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.errors import InputError
from addon.ui import cache_folder as module
from addon.ui.cache_folder import cache_folder


def scene() -> Any:
    return bpy.context.scene


def test_an_unsaved_file_has_none(extension: None) -> None:
    with pytest.raises(InputError, match=r"save the \.blend"):
        cache_folder(scene())
    scene().relume.cache_folder = "//cache"
    with pytest.raises(InputError, match=r"save the \.blend"):
        cache_folder(scene())


def test_beside_the_blend_under_its_name(extension: None, tmp_path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.010.blend"))
    assert cache_folder(scene()) == tmp_path / "shot.010.relume"


def test_where_the_artist_says(extension: None, tmp_path: Path) -> None:
    scene().relume.cache_folder = str(tmp_path / "elsewhere")
    assert cache_folder(scene()) == tmp_path / "elsewhere"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    scene().relume.cache_folder = "//here/"
    assert cache_folder(scene()) == tmp_path / "here"


def test_never_inside_the_extension(extension: None) -> None:
    """Blender deletes that folder when it updates the extension."""
    scene().relume.cache_folder = str(Path(module.__file__).parent.parent / "x")
    with pytest.raises(InputError, match="outside"):
        cache_folder(scene())
