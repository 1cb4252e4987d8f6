# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a scene's cache lies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy

from ..errors import InputError

SUFFIX = ".relume"

_EXTENSION = Path(__file__).resolve().parent.parent


def cache_folder(scene: Any) -> Path:
    """The scene's cache folder, absolute; it need not exist.

    Raises:
        InputError: the .blend was never saved and the folder is relative to it, or the folder
            is inside the extension, which an update would delete.
    """
    text = scene.relume.cache_folder
    blend = bpy.data.filepath
    if not blend and (not text or text.startswith("//")):
        raise InputError("save the .blend first, or choose a cache folder")
    if text:
        folder = Path(bpy.path.abspath(text)).absolute()
    else:
        folder = Path(blend).with_suffix(SUFFIX).absolute()
    if folder.is_relative_to(_EXTENSION):
        raise InputError("choose a cache folder outside the extension's own")
    return folder
