# SPDX-License-Identifier: GPL-3.0-or-later
"""Placing and baking, as everything does it that makes a cache."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .caching.bake import BakeReport, BakeSettings, bake_scene
from .caching.bake_settings import earlier_cache
from .caching.fingerprint import scene_fingerprint
from .camplace.camera import CachingCamera
from .camplace.place import place_cameras
from .camplace.settings import PlacementSettings
from .progress import Progress, part_of
from .scene.geometry import SceneGeometry
from .scene.shot_reader import read_shot
from .writable import require_folder

# The share of the time that placing takes, of placing and baking.
PLACING = 0.3


@dataclass(frozen=True)
class Baking:
    """What to bake: the open `bpy.types.Scene`, its surfaces, where to, and how."""

    scene: Any
    geometry: SceneGeometry
    cache: Path
    settings: BakeSettings

    def run(self, cameras: Sequence[CachingCamera], progress: Progress) -> BakeReport:
        """Bake these cameras; without any, those that the cache was begun with, if that is to be
        gone on with, or else cameras that are placed for the scene's shot first.

        Raises:
            InputError: the folder holds another scene's cache, or cannot be written.
        """
        # Asked before the minutes that placing may take.
        require_folder(self.cache)
        earlier = earlier_cache(self.cache, scene_fingerprint(self.geometry), self.settings)
        goes_on = self.settings.resume or self.settings.only is not None
        if not cameras and goes_on and earlier is not None:
            cameras = earlier.manifest.cameras
        if not cameras:
            placing = part_of(progress, 0.0, PLACING)
            views = read_shot(self.scene)
            cameras = place_cameras(self.geometry, views, PlacementSettings(), placing).cameras
            progress = part_of(progress, PLACING, 1.0)
        return bake_scene(self.scene, self.geometry, cameras, self.cache, self.settings, progress)
