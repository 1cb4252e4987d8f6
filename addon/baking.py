# SPDX-License-Identifier: GPL-3.0-or-later
"""Placing and baking, as everything does it that makes a cache."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .caching.bake import BakeReport, BakeSettings, bake_scene
from .caching.bake_settings import earlier_cache
from .caching.edited_cameras import PLACEMENT_NAME, edited_cameras
from .caching.fingerprint import read_state
from .caching.frames import own_frame
from .caching.manifest import Manifest
from .caching.presets import PRESETS
from .caching.store import CacheStore
from .camplace.camera import CachingCamera
from .camplace.cameras_file import read_cameras
from .camplace.place import place_cameras
from .camplace.settings import PlacementSettings
from .errors import InputError
from .progress import Progress, part_of
from .scene.caching_collection_reader import caching_collection, caching_objects
from .scene.depsgraph_reader import viewport_depsgraph, with_render_depsgraph
from .scene.geometry import SceneGeometry
from .scene.geometry_reader import read_geometry
from .scene.shot import ALL_CAMERAS, ShotChoice, describe_shot
from .scene.shot_reader import read_shot
from .writable import require_folder

# The share of the time that placing takes, of placing and baking.
PLACING = 0.3


def _say_nothing(sentence: str) -> None:
    """A `Baking.say` that nobody hears."""


@dataclass(frozen=True)
class Baking:
    """What to bake: the open `bpy.types.Scene`, its surfaces, where to, and how.

    Attributes:
        shot: whose views cameras are placed for, if they are placed.
        anew: do not take the caching cameras that the scene's collection holds.
        say: is told which cameras are baked, in one sentence, where nobody named them.
    """

    scene: Any
    geometry: SceneGeometry
    cache: Path
    settings: BakeSettings
    shot: ShotChoice = ALL_CAMERAS
    anew: bool = False
    say: Callable[[str], None] = _say_nothing

    def run(self, cameras: Sequence[CachingCamera], progress: Progress) -> BakeReport:
        """Bake these cameras; without any, the first that there are of the following.

        * the caching cameras in the scene, with what the artist did to them, unless `anew`;
        * those that the cache was begun with, if that is to be gone on with;
        * cameras that are placed for the shot now.

        Raises:
            InputError: the folder holds another scene's cache, or cannot be written, or a
                caching camera in the scene cannot be baked.
        """
        # Asked before the minutes that placing may take.
        require_folder(self.cache)
        first = self._first_frame()
        if first == self.scene.frame_current:
            return self._run(cameras, progress)
        with own_frame(self.scene):
            self.scene.frame_set(first)
            geometry = with_render_depsgraph(self.scene, read_geometry)
            return replace(self, geometry=geometry).run(cameras, progress)

    @property
    def _goes_on(self) -> bool:
        """Whether an earlier cache is gone on with."""
        return self.settings.resume or self.settings.only is not None

    def _first_frame(self) -> int:
        """The frame that is baked whole.

        A cache of several frames keeps its first one, whatever the scene's current frame is: what
        is baked at the others is told from that.
        """
        frames = self.settings.frames
        earlier = self._earlier_manifest() if self._goes_on else None
        if earlier is not None and (frames or earlier.frames):
            if not frames and earlier.frame != self.scene.frame_current:
                self.say(f"the cache's first frame, {earlier.frame}, is baked")
            return earlier.frame
        return frames[0] if frames else int(self.scene.frame_current)

    def _earlier_manifest(self) -> Manifest | None:
        try:
            return CacheStore.open(self.cache).manifest
        except InputError:  # earlier_cache says so
            return None

    def _run(self, cameras: Sequence[CachingCamera], progress: Progress) -> BakeReport:
        """Bake at the scene's current frame, at which the geometry was read."""
        state = read_state(self.geometry, int(self.scene.frame_current))
        earlier = earlier_cache(self.cache, state.surfaces, state.fingerprint, self.settings)
        if not cameras and not self.anew:
            cameras = self._shown(earlier, progress)
        if not cameras and self._goes_on and earlier is not None:
            cameras = earlier.manifest.cameras
        seconds = {}
        if not cameras:
            started = time.monotonic()
            cameras = self._placed(part_of(progress, 0.0, PLACING))
            seconds["place"] = time.monotonic() - started
            progress = part_of(progress, PLACING, 1.0)
        elif self.shot != ALL_CAMERAS:
            self.say("no cameras were placed, so that the choice of a shot made no difference")
        report = bake_scene(self.scene, self.geometry, cameras, self.cache, self.settings, progress)
        return replace(report, seconds={**seconds, **report.seconds})

    def _shown(self, earlier: CacheStore | None, progress: Progress) -> Sequence[CachingCamera]:
        """The caching cameras in the scene; those that nobody touched are the placed ones."""
        if not caching_objects(self.scene):
            emptied = caching_collection(self.scene)
            if emptied is not None:
                self.say(f"the collection '{emptied.name}' holds no caching camera any more")
            return ()
        placement = self.cache / PLACEMENT_NAME
        placed = read_cameras(placement) if placement.exists() else ()
        baked = () if earlier is None else earlier.manifest.cameras
        largest = PRESETS[self.settings.preset].max_resolution
        graph = viewport_depsgraph(self.scene)
        cameras = edited_cameras(graph, self.scene, placed, largest, baked) or ()
        name = caching_collection(self.scene).name  # type: ignore[union-attr]
        sentence = (
            f"the {len(cameras)} caching cameras in the scene's collection '{name}' are baked"
        )
        progress(0.0, sentence)
        self.say(f"{sentence} (relume bake --place-anew places others)")
        return cameras

    def _placed(self, progress: Progress) -> Sequence[CachingCamera]:
        views = read_shot(self.scene, self.shot)
        settings = PlacementSettings(max_resolution=PRESETS[self.settings.preset].max_resolution)
        cameras = place_cameras(self.geometry, views, settings, progress).cameras
        if self.shot != ALL_CAMERAS:
            names = [view.name for view in views]
            self.say(f"{len(cameras)} caching cameras were placed for {describe_shot(names)}")
        return cameras
