# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells cheaply whether a cache was baked anew."""

from __future__ import annotations

from pathlib import Path

from ..caching.manifest_file import MANIFEST_NAME


def cache_stamp(folder: Path, name: str = MANIFEST_NAME) -> int:
    """A number that changes with a file of the cache, or with its manifest, which is written last;
    0 without one."""
    try:
        state = (folder / name).stat()
    except OSError:
        return 0
    # The time alone may come again: clocks are put back, and some file systems count seconds.
    return hash((state.st_mtime_ns, state.st_ino, state.st_size))
