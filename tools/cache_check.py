# SPDX-License-Identifier: GPL-3.0-or-later
"""What the verbs ask of a cache before they work with it."""

from __future__ import annotations

from pathlib import Path
from typing import cast

from addon.caching.fingerprint import scene_fingerprint
from addon.caching.presets import Preset
from addon.caching.store import MANIFEST_NAME, CacheStore
from addon.scene.geometry import SceneGeometry


def cached_preset(cache: Path) -> Preset | None:
    """The preset of an earlier bake into this folder; None without one.

    Raises:
        InputError: there is a cache, but a damaged one or of another version.
    """
    if not (cache / MANIFEST_NAME).exists():
        return None
    return cast("Preset", CacheStore.open(cache).manifest.settings.get("preset"))


def check_cache(geometry: SceneGeometry, cache: Path, frame: int) -> CacheStore:
    """The cache of the open scene as it is now, at this frame.

    Raises:
        InputError: the folder is no cache of it, or does not hold this frame.
    """
    return CacheStore.open(cache).showing(scene_fingerprint(geometry, frame), frame)
