# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells cheaply whether a cache was baked anew."""

from __future__ import annotations

from pathlib import Path

from ..caching.store import MANIFEST_NAME


def cache_stamp(folder: Path) -> int:
    """A number that changes with the cache's manifest, which is written last; 0 without one."""
    try:
        return (folder / MANIFEST_NAME).stat().st_mtime_ns
    except OSError:
        return 0
