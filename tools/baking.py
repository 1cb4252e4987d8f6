# SPDX-License-Identifier: GPL-3.0-or-later
"""Placing and baking, as the bake and evaluate verbs and the demo do it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from addon.camplace.camera import CachingCamera
from addon.camplace.place import place_cameras
from addon.camplace.settings import PlacementSettings
from addon.progress import Progress
from addon.scene.geometry import SceneGeometry

from .output import part_of

if TYPE_CHECKING:
    from addon.caching.bake import BakeReport, BakeSettings, Preset
    from addon.caching.store import Manifest

# The share of the time that placing takes, of placing and baking.
PLACING = 0.3


def cached_cameras(cache: Path) -> tuple[CachingCamera, ...]:
    """The cameras that an earlier bake into this folder began with; none without one.

    Raises:
        InputError: there is a cache, but a damaged one or of another version.
    """
    manifest = _manifest(cache)
    return () if manifest is None else manifest.cameras


def cached_preset(cache: Path) -> Preset | None:
    """The preset of an earlier bake into this folder; None without one. Raises as above."""
    manifest = _manifest(cache)
    return None if manifest is None else cast("Preset", manifest.settings.get("preset"))


def _manifest(cache: Path) -> Manifest | None:
    from addon.caching.store import MANIFEST_NAME, CacheStore

    if not (cache / MANIFEST_NAME).exists():
        return None
    return CacheStore.open(cache).manifest


@dataclass(frozen=True)
class Baking:
    """What to bake: the open `bpy.types.Scene`, its surfaces, where to, and how."""

    scene: Any
    geometry: SceneGeometry
    cache: Path
    settings: BakeSettings

    def run(self, cameras: Sequence[CachingCamera], progress: Progress) -> BakeReport:
        """Bake these cameras; without any, place them for the scene's shot first.

        Raises:
            InputError: the folder holds another scene's cache, or cannot be written.
        """
        from addon.caching.bake import bake_scene
        from addon.scene.shot_reader import read_shot

        if not cameras:
            placing = part_of(progress, 0.0, PLACING)
            views = read_shot(self.scene)
            cameras = place_cameras(self.geometry, views, PlacementSettings(), placing).cameras
            progress = part_of(progress, PLACING, 1.0)
        return bake_scene(self.scene, self.geometry, cameras, self.cache, self.settings, progress)


def check_cache(geometry: SceneGeometry, cache: Path) -> None:
    """Raises InputError when the folder is no cache of the open scene as it is now."""
    from addon.caching.fingerprint import scene_fingerprint
    from addon.caching.store import CacheStore

    CacheStore.open(cache).check_fingerprint(scene_fingerprint(geometry))
