# SPDX-License-Identifier: GPL-3.0-or-later
"""Asks whether results can be written before the work that makes them."""

from __future__ import annotations

import tempfile
from pathlib import Path

from .errors import InputError
from .whole_file import write_errors


def require_file(path: Path, *, in_new_folder: bool = True) -> None:
    """Make sure that a file can be written here; nothing is left there.

    Args:
        path: the file, which may exist.
        in_new_folder: its folder will be made.

    Raises:
        InputError: it is a folder, or its folder cannot be written.
    """
    if path.is_dir():
        raise InputError(f"{path} cannot be written: it is a folder; choose another place")
    _try(path, _existing(path.parent) if in_new_folder else path.parent)


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
