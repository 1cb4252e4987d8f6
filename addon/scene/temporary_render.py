# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders into the folder for temporary files, the only way from Cycles to Python."""

from __future__ import annotations

import shutil
from pathlib import Path

import bpy

from ..errors import InputError
from ..stopping import uninterrupted


def render_to(path: Path, least_bytes: int, what: str, **arguments: str) -> None:
    """Have Blender render and write the file that the scene's render settings name.

    Args:
        path: that file, in a folder made in the one for temporary files.
        least_bytes: size of what is read from it, not compressed. Blender does not say that it
            had no room for all of a file.
        what: is rendered, for the error.
        arguments: further ones of `bpy.ops.render.render`.

    Raises:
        InputError: it was not written, or not whole.
    """
    path.unlink(missing_ok=True)
    reason = "no picture was written"
    try:
        with uninterrupted():
            bpy.ops.render.render(write_still=True, **arguments)
    except RuntimeError as error:
        reason = " ".join(str(error).split())
    size = path.stat().st_size if path.is_file() else 0
    if size >= least_bytes:
        return
    if shutil.disk_usage(path.parent).free < least_bytes - size:
        raise InputError(
            f"the folder for temporary files, {path.parent.parent}, has no room for {what} "
            f"({least_bytes / 1e6:.1f} MB); free some space there, or name another folder in the "
            "environment variable TMPDIR"
        )
    raise InputError(
        f"Cycles rendered nothing for {what} ({reason}); free some memory, or choose a smaller size"
    )
