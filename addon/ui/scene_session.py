# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens a relight session on an evaluated scene, and keeps it up to date."""

from __future__ import annotations

from typing import Any

from ..caching.store import CacheStore
from ..corrmap.correspondence import Coverage
from ..relight.session import RelightSession
from ..scene.geometry_reader import read_geometry
from ..scene.light_reader import read_lights
from ..scene.world_reader import read_world
from .cache_folder import cache_folder
from .cache_stamp import cache_stamp
from .scene_changes import SceneChanges


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
        folder = cache_folder(depsgraph.scene)
        self.stamp = cache_stamp(folder)
        store = CacheStore.open(folder)
        geometry = read_geometry(depsgraph)
        self.session = RelightSession(geometry, store, samples)
        self._warnings = {"geometry": geometry.warnings}
        self.update(depsgraph, SceneChanges(lights=True, world=True))

    def update(self, depsgraph: Any, changes: SceneChanges) -> None:
        """Tell the session what changed in the scene."""
        if changes.geometry:
            geometry = read_geometry(depsgraph)
            self.session.set_geometry(geometry)
            self._warnings["geometry"] = geometry.warnings
        if changes.lights:
            lights = read_lights(depsgraph)
            self.session.set_lights(lights)
            self._warnings["lights"] = tuple(text for light in lights for text in light.warnings)
        if changes.world:
            world = read_world(depsgraph)
            self.session.set_world(world)
            self._warnings["world"] = world.warnings if world is not None else ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence for each thing that is left out or approximated; materials are listed
        with the cache."""
        return tuple(text for part in self._warnings.values() for text in part)


def describe_holes(coverage: Coverage) -> str:
    """How much of the picture the cache does not show, for the status line."""
    if coverage.hole_fraction == 0.0:
        return "all of the picture is in the cache"
    return f"{100.0 * coverage.hole_fraction:.2f} % of the picture is not in the cache"
