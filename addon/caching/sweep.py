# SPDX-License-Identifier: GPL-3.0-or-later
"""What does not belong to a cache any more, removed from its folder."""

from __future__ import annotations

from collections.abc import Collection
from itertools import chain
from pathlib import Path

from .cache_names import WORLD_STEM, is_picture
from .folder_lock import LOCK_NAME

# Writing one file takes seconds; a temporary file older than this has no writer any more.
_PART_SECONDS = 3600.0


def sweep(folder: Path, names: Collection[str]) -> None:
    """Remove pictures but those of these names, and what a killed process left. What a cache does
    not name so stays: an artist may have chosen a folder of other pictures too.

    To be called where no other process changes the cache.
    """
    pictures = (
        (folder / "cameras").glob("*.exr"),
        (folder / "frames").glob("*/*.exr"),
        folder.glob(f"{WORLD_STEM}*.exr"),
    )
    named = ((path, path.relative_to(folder).as_posix()) for path in chain(*pictures))
    stale = [path for path, name in named if is_picture(name) and name not in names]
    # By the clock that the files' own times are of, which may be another computer's.
    lock = folder / LOCK_NAME
    lock.touch()
    before = lock.stat().st_mtime - _PART_SECONDS
    stale += [path for path in folder.rglob(".*.[0-9]*.part") if _is_older(path, before)]
    for path in stale:
        path.unlink(missing_ok=True)


def _is_older(path: Path, moment: float) -> bool:
    """Whether a file was last changed before; not if another process has just renamed it."""
    try:
        return path.stat().st_mtime < moment
    except FileNotFoundError:
        return False
