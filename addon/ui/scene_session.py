# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens a relight session on an evaluated scene, and keeps it up to date."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..caching.fingerprint import scene_fingerprint
from ..caching.store import CacheStore
from ..relight.session import RelightSession
from ..scene.geometry_reader import read_geometry
from ..scene.light_reader import read_lights
from ..scene.world import World
from ..scene.world_reader import read_world
from .cache_folder import cache_folder
from .cache_stamp import cache_stamp
from .cache_state import note_staleness
from .scene_changes import SceneChanges

STALE_SURFACES = "shapes or materials changed after the bake: bake again"
STALE_WORLD = "the world changed after the bake, and is shown as it was: bake again"


class SceneSession:
    """A `RelightSession` of the open file, with what Blender needs to know beside it.

    Attributes:
        session: the session itself.
        stamp: the cache's `cache_stamp` when it was opened.
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
        store = CacheStore.open(self._folder)
        self._manifest = store.manifest
        self._stale: dict[str, bool] = {}
        self._geometry = read_geometry(depsgraph)
        self.session = RelightSession(self._geometry, store, samples)
        self._warnings = {"geometry": self._geometry.warnings}
        self._check()
        self.update(depsgraph, SceneChanges(lights=True, world=True))

    def update(self, depsgraph: Any, changes: SceneChanges) -> None:
        """Tell the session what changed in the scene."""
        if changes.geometry:
            self._geometry = read_geometry(depsgraph)
            self.session.set_geometry(self._geometry)
            self._warnings["geometry"] = self._geometry.warnings
        if changes.geometry or changes.materials:
            self._check()
        if changes.lights:
            lights = read_lights(depsgraph)
            self.session.set_lights(lights)
            self._warnings["lights"] = tuple(text for light in lights for text in light.warnings)
        if changes.world:
            self._set_world(read_world(depsgraph))

    def _set_world(self, world: World | None) -> None:
        self._warnings["world"] = world.warnings if world is not None else ()
        baked = self._manifest.world_fingerprint
        changed = world is not None and world.needs_baking and world.fingerprint != baked
        if world is not None and changed and self._manifest.world is not None:
            # While an artist edits the world, the picture goes on with the one that was baked.
            world = replace(world, fingerprint=baked)
        self.session.set_world(world)
        self._note(STALE_WORLD, changed)

    def _check(self) -> None:
        changed = scene_fingerprint(self._geometry) != self._manifest.fingerprint
        self._note(STALE_SURFACES, changed)

    def _note(self, sentence: str, is_stale: bool) -> None:
        self._stale[sentence] = is_stale
        note_staleness(self._folder, self.stamp, self.stale)

    @property
    def stale(self) -> tuple[str, ...]:
        """A sentence for each part of the scene that is no longer what was baked."""
        return tuple(sentence for sentence, is_stale in self._stale.items() if is_stale)

    def describe(self) -> str:
        """What the status line says about the cache."""
        coverage = self.session.coverage
        if coverage.hole_fraction == 0.0:
            text = "all of the picture is in the cache"
        else:
            text = f"{100.0 * coverage.hole_fraction:.2f} % of the picture is not in the cache"
        return "; ".join((text, *self.stale))

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence for each thing that is left out or approximated; materials are listed
        with the cache."""
        read = tuple(text for part in self._warnings.values() for text in part)
        return (*read, *self.session.warnings)
