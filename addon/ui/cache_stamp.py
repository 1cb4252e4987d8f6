# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells cheaply whether a cache was baked anew."""

from __future__ import annotations

from pathlib import Path


def cache_stamp(folder: Path) -> int:
    """A number that changes with the cache's manifest, which is written last; 0 without one."""
    try:
        return (folder / "manifest.json").stat().st_mtime_ns
    except OSError:
        return 0
