# SPDX-License-Identifier: GPL-3.0-or-later
"""The open scene relit from its cache: what the relight and evaluate verbs share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from addon.errors import InputError
from addon.scene.geometry import SceneGeometry
from addon.scene.light import Light
from addon.scene.view import View
from addon.scene.world import World

if TYPE_CHECKING:
    from addon.relight.session import RelightSession


@dataclass(frozen=True)
class SceneArrays:
    """Everything that the session needs of a scene, as a render would see it.

    Attributes:
        geometry: its surfaces.
        lights: what is lit.
        world: None when it is black.
        views: one for each camera asked for.
        warnings: one sentence for each thing left out or approximated.
    """

    geometry: SceneGeometry
    lights: tuple[Light, ...]
    world: World | None
    views: tuple[View, ...]
    warnings: tuple[str, ...]


def read_scene(
    scene: Any, cameras: Sequence[str | None], size: tuple[int, int] | None = None
) -> SceneArrays:
    """Read the open scene at its current frame.

    Args:
        scene: a `bpy.types.Scene`.
        cameras: names of camera objects; None for the scene's active one.
        size: width and height of the views; None for the scene's.

    Raises:
        InputError: there is no mesh, or no such camera.
    """
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.geometry_reader import read_geometry
    from addon.scene.light_reader import read_lights
    from addon.scene.view_reader import find_camera, read_view
    from addon.scene.world_reader import read_world

    objects = [find_camera(scene, name) for name in cameras]

    def read(depsgraph: Any) -> SceneArrays:
        geometry, rig, world = (
            read_geometry(depsgraph),
            read_lights(depsgraph),
            read_world(depsgraph),
        )
        views = tuple(read_view(depsgraph, camera, *(size or ())) for camera in objects)
        warnings = geometry.warnings + rig.warnings + (() if world is None else world.warnings)
        return SceneArrays(geometry, rig.lights, world, views, warnings)

    return with_render_depsgraph(scene, read)


def camera_names(scene: Any) -> list[str | None]:
    """The names of all cameras of a scene; without any, None, which `read_scene` refuses."""
    return sorted(obj.name for obj in scene.objects if obj.type == "CAMERA") or [None]


def require_light(scene: Any, arrays: SceneArrays) -> None:
    """Raises InputError when nothing in the scene gives light."""
    if not arrays.lights and arrays.world is None:
        raise InputError(f"Scene '{scene.name}' has no light; add one to relight it.")


def open_session(arrays: SceneArrays, cache: Path, samples: int) -> RelightSession:
    """A session on a scene's cache, with the scene's lights and world.

    Args:
        arrays: the scene.
        cache: the cache's folder.
        samples: of a finished picture's pixel.

    Raises:
        InputError: there is no such cache, it is damaged, or it was baked from another scene.
    """
    import gpu
    from addon.caching.store import CacheStore
    from addon.relight.session import RelightSession

    gpu.init()
    session = RelightSession(arrays.geometry, CacheStore.open(cache), samples)
    session.set_lights(arrays.lights)
    session.set_world(arrays.world)
    return session
