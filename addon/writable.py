# SPDX-License-Identifier: GPL-3.0-or-later
"""Asks whether results can be written before the work that makes them."""

from __future__ import annotations

import tempfile
from pathlib import Path

from .whole_file import place_of, write_errors


def require_file(path: Path, *, in_new_folder: bool = True) -> None:
    """Make sure that a file can be written here; nothing is left there.

    Args:
        path: the file, which may exist.
        in_new_folder: its folder will be made.

    Raises:
        InputError: something is there that is no file, or its folder cannot be written.
    """
    folder = place_of(path).parent
    _try(path, _existing(folder) if in_new_folder else folder)


def require_folder(folder: Path) -> None:
    """Make sure that files can be written in this folder, which may be made first.

    Raises:
        InputError: they cannot.
    """
    _try(folder, _existing(folder))


def _existing(folder: Path) -> Path:
    """The folder, or the nearest one above it that exists."""
    folder = folder.absolute()
    return next(place for place in (folder, *folder.parents) if place.exists())


def _try(path: Path, folder: Path) -> None:
    with write_errors(path), tempfile.TemporaryFile(dir=folder):
        pass
