# SPDX-License-Identifier: GPL-3.0-or-later
"""What the verbs ask of a cache before they work with it."""

from __future__ import annotations

from pathlib import Path

from addon.caching.fingerprint import scene_fingerprint
from addon.caching.store import CacheStore
from addon.scene.geometry import SceneGeometry


def check_cache(geometry: SceneGeometry, cache: Path, frame: int) -> CacheStore:
    """The cache of the open scene as it is now, at this frame.

    Raises:
        InputError: the folder is no cache of it, or does not hold this frame.
    """
    return CacheStore.open(cache).showing(scene_fingerprint(geometry, frame), frame)
