# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens .blend files for the command line, and says plainly what is wrong with them."""

from __future__ import annotations

import gzip
import io
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

from addon.errors import InputError
from addon.stopping import uninterrupted

PLAIN_MAGIC = b"BLENDER"
GZIP_MAGIC = b"\x1f\x8b"
# RFC 8878; Blender compresses in frames, and a skippable frame may stand first.
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
ZSTD_SKIPPABLE = b"\x2a\x4d\x18"
# Blender prints what it also raises.
FAILURE_LINE = "Error: Loading "


def load_blender() -> None:
    """Import bpy, which crashes when it is interrupted in that, and register lights' controls."""
    with uninterrupted():
        import bpy  # noqa: F401

        from addon.ui import light_properties

        # What artists set on lights is to be read and edited here too.
        light_properties.register()


def check_blend(path: Path) -> None:
    """Make sure that this looks like a .blend: plain, or compressed with zstd or gzip.

    Raises:
        InputError: it is missing, a folder, unreadable, empty or of another kind.
    """
    if not path.exists():
        raise InputError(f"There is no file {path}; check the path.")
    if not path.is_file():
        raise InputError(f"{path} is not a file; give a .blend file.")
    try:
        with path.open("rb") as file:
            start = file.read(len(PLAIN_MAGIC))
        if start.startswith(GZIP_MAGIC):
            with gzip.open(path) as file:
                start = file.read(len(PLAIN_MAGIC))
    except (EOFError, gzip.BadGzipFile, zlib.error):
        start = b"?"
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); check its rights.") from None
    if not start:
        raise InputError(f"{path} is empty; save it again in Blender.")
    zstd = start.startswith(ZSTD_MAGIC) or start[1:4] == ZSTD_SKIPPABLE
    if start != PLAIN_MAGIC and not zstd:
        raise InputError(f"{path} is not a .blend file; give one that Blender saved.")


def open_scene(path: Path) -> Any:
    """Open a .blend in this process and give its scene, a `bpy.types.Scene`.

    Raises:
        InputError: see `check_blend`; or Blender cannot read the file.
    """
    check_blend(path)
    load_blender()
    import bpy

    try:
        with uninterrupted(), _without_failure_line():
            bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False)
    except RuntimeError as error:
        reason = " ".join(str(error).split())
        # The innermost reason: those around it name the file again.
        reason = reason.rpartition(f"'{path.resolve()}': ")[2].removeprefix("Error: ")
        raise InputError(f"{path} cannot be opened ({reason}); save it again.") from None
    return bpy.context.scene


@contextmanager
def _without_failure_line() -> Iterator[None]:
    """Blender prints its reports through `sys.stdout`; the others come when the block ends."""
    said = io.StringIO()
    try:
        with redirect_stdout(said):
            yield
    finally:
        lines = said.getvalue().splitlines(keepends=True)
        sys.stdout.write("".join(line for line in lines if not line.startswith(FAILURE_LINE)))
