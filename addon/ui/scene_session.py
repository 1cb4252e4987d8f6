# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens a relight session on an evaluated scene, and keeps it up to date."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from ..caching.fingerprint import read_state
from ..caching.scene_state import SceneState
from ..caching.store import CacheStore
from ..caching.temporary_store import TemporaryStore
from ..caching.what_changed import surely_stale
from ..errors import InputError
from ..relight.session import RelightSession
from ..relight.shadows.shadow_frustum import ShadowSettings
from ..scene.exposure import Exposure
from ..scene.exposure_reader import ReadAt, read_exposure
from ..scene.geometry_reader import read_geometry
from ..scene.light_linking_reader import read_emitter_linking
from ..scene.light_reader import read_lights
from ..scene.render_region import RenderRegion
from ..scene.surface_edit_reader import read_surface_edits
from ..scene.view import View
from ..scene.world import World
from ..scene.world_reader import read_world, world_warnings
from .cache_folder import cache_folder
from .cache_stamp import cache_stamp
from .cache_state import note_staleness
from .scene_changes import SceneChanges

STALE_SURFACES = "shapes or materials changed after the bake: bake again"
_SHADOWS = {
    "AUTO": ShadowSettings(method="auto"),
    "MAP": ShadowSettings(),
    "TRACED": ShadowSettings(method="traced"),
}

STALE_WORLD = "the world changed after the bake, and is shown as it was: bake again"


class SceneSession:
    """A `RelightSession` of the open file, with what Blender needs to know beside it.

    Attributes:
        session: the session itself.
        stamp: the cache's `cache_stamp` when it was opened.
        is_left: the scene came to a frame that the cache holds, but this session does not show.
    """

    def __init__(self, depsgraph: Any, samples: int) -> None:
        """Needs a GPU context, as the session does all its life.

        Args:
            depsgraph: the evaluated scene.
            samples: of a finished picture.

        Raises:
            InputError: there is no cache, or it or the scene cannot be used.
        """
        self._folder = cache_folder(depsgraph.scene)
        self.stamp = cache_stamp(self._folder)
        self.is_left = False
        self._cache = CacheStore.open(self._folder)
        self._stale: dict[str, str] = {}
        self._geometry = read_geometry(depsgraph)
        state = self._state(depsgraph)
        store = self._cache.matching(state.fingerprint, state.frame) or self._cache
        self._manifest = store.manifest
        self.session = RelightSession(self._geometry, store, samples)
        self._temporary = TemporaryStore(store)
        self._filled_stamp = 0
        self._warnings = {"geometry": self._geometry.warnings}
        self.follow_filled()
        self.follow_settings(depsgraph.scene)
        self._check(state)
        self.update(depsgraph, SceneChanges(lights=True, world=True, edits=True))

    def follow_settings(self, scene: Any) -> None:
        """Find shadows the way that a `bpy.types.Scene` says, and leave out what it mutes."""
        settings = scene.relume
        self.session.set_shadows(_SHADOWS[settings.shadows])
        self.session.set_muted(world=settings.mute_world, emission=settings.mute_emission)

    def read_exposure(
        self,
        scene: Any,
        camera: Any,
        view: View,
        read_at: ReadAt,
        *,
        region: RenderRegion | None = None,
    ) -> Exposure | None:
        """What moves while the shutter of a camera is open, if the scene's render settings say that
        it is blurred; see `read_exposure`."""
        return read_exposure(scene, camera, view, self._geometry, read_at, region=region)

    def set_exposure(self, exposure: Exposure | None) -> None:
        """Blur what moves so."""
        self.session.set_exposure(exposure)
        self._warnings["exposure"] = exposure.warnings if exposure is not None else ()

    @property
    def folder(self) -> Path:
        """The cache's."""
        return self._folder

    def follow_filled(self) -> bool:
        """Show the temporary pictures that there are beside the cache; whether they are others
        than before."""
        stamp = cache_stamp(self._temporary.folder)
        if stamp == self._filled_stamp:
            return False
        self._filled_stamp = stamp
        try:
            self.session.set_added(self._temporary.read())
            self._warnings["filled"] = ()
        except InputError as error:
            # The cache goes on without them.
            self.session.set_added(())
            self._warnings["filled"] = (f"what was baked for holes is not shown: {error}",)
        return True

    def update(self, depsgraph: Any, changes: SceneChanges) -> None:
        """Tell the session what changed in the scene."""
        if changes.geometry:
            self._geometry = read_geometry(depsgraph)
            self.session.set_geometry(self._geometry)
            self._warnings["geometry"] = self._geometry.warnings
        if changes.geometry or changes.materials:
            self._check(self._state(depsgraph))
        if changes.lights:
            lights = read_lights(depsgraph)
            self.session.set_lights(lights)
            self._warnings["lights"] = tuple(text for light in lights for text in light.warnings)
        if changes.lights or changes.edits:
            self.session.set_emitter_linking(read_emitter_linking(depsgraph))
        if changes.edits:
            self.session.set_surface_edits(read_surface_edits(depsgraph))
        if changes.world:
            self._set_world(read_world(depsgraph))
            self._warnings["world"] = world_warnings(depsgraph)

    def _set_world(self, world: World | None) -> None:
        baked = self._manifest.world_fingerprint
        changed = world is not None and world.needs_baking and world.fingerprint != baked
        if world is not None and changed and self._manifest.world is not None:
            # While an artist edits the world, the picture goes on with the one that was baked.
            world = replace(world, fingerprint=baked)
        self.session.set_world(world)
        self._note("world", STALE_WORLD if changed else "")

    def _state(self, depsgraph: Any) -> SceneState:
        frame = int(depsgraph.scene_eval.frame_current)
        return read_state(self._geometry, frame, depsgraph)

    def _check(self, state: SceneState) -> None:
        manifest = self._manifest
        if state.fingerprint == manifest.fingerprint:
            self._note("surfaces", "")
            return
        self.is_left = self._cache.matching(state.fingerprint, state.frame) is not None
        text = STALE_SURFACES
        # A frame's own surfaces are not kept: what its pictures show can be compared at the first.
        if manifest.fingerprint == self._cache.manifest.fingerprint:
            count = surely_stale(manifest.surfaces, state.surfaces, manifest.seen)
            if count:
                text += f" (seen by {count} or more of {len(manifest.cameras)} cameras)"
        self._note("surfaces", text)

    def _note(self, part: str, sentence: str) -> None:
        self._stale[part] = sentence
        note_staleness(self._folder, self.stamp, self.stale)

    @property
    def stale(self) -> tuple[str, ...]:
        """A sentence for each part of the scene that is no longer what was baked."""
        return tuple(sentence for sentence in self._stale.values() if sentence)

    def describe(self) -> str:
        """What the status line says about the cache."""
        coverage = self.session.coverage
        if coverage.hole_fraction == 0.0:
            text = "all of the picture is in the cache"
        else:
            share = 100.0 * coverage.hole_fraction
            # A few pixels of millions are holes still.
            percent = f"{share:.2f}" if share >= 0.005 else "less than 0.01"
            text = f"{percent} % of the picture is not in the cache"
        return "; ".join((text, *self.stale))

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence for each thing that is left out or approximated; materials are listed
        with the cache."""
        read = tuple(text for part in self._warnings.values() for text in part)
        return (*read, *self.session.warnings)
