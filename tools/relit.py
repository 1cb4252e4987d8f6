# SPDX-License-Identifier: GPL-3.0-or-later
"""The open scene relit from its cache: what the relight and evaluate verbs share."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from addon.errors import InputError
from addon.scene.geometry import SceneGeometry
from addon.scene.light import Light
from addon.scene.view import View
from addon.scene.world import World

Edits = Mapping[str, Mapping[str, Any] | None]


@dataclass(frozen=True)
class SceneArrays:
    """Everything that the session needs of a scene, read from it as a render would see it."""

    geometry: SceneGeometry
    lights: tuple[Light, ...]
    world: World
    views: tuple[View, ...]


def read_scene(
    scene: Any, cameras: Sequence[str | None], size: tuple[int, int] | None = None
) -> SceneArrays:
    """Read the open scene at its current frame.

    Args:
        scene: a `bpy.types.Scene`.
        cameras: names of camera objects; None for the scene's active one.
        size: width and height of the views; None for the scene's.

    Raises:
        InputError: there is no mesh, no light, or no such camera.
    """
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.geometry_reader import read_geometry
    from addon.scene.light_reader import read_lights
    from addon.scene.view_reader import find_camera, read_view
    from addon.scene.world_reader import read_world

    objects = [find_camera(scene, name) for name in cameras]

    def read(depsgraph: Any) -> SceneArrays:
        views = tuple(read_view(depsgraph, camera, *(size or ())) for camera in objects)
        lights = tuple(read_lights(depsgraph))
        return SceneArrays(read_geometry(depsgraph), lights, read_world(depsgraph), views)

    arrays: SceneArrays = with_render_depsgraph(scene, read)
    if not any(light.is_lit for light in arrays.lights):
        raise InputError(f"Scene '{scene.name}' has no light; add one to relight it.")
    return arrays


def read_edits(path: Path) -> Edits:
    """Read an EDITS.json: attributes to change by the light's name, or null to switch it off.

    Raises:
        InputError: it is missing or not such a file. Unknown names are left to whoever applies
            the edits.
    """
    try:
        edits = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); check the path.") from None
    except ValueError as error:
        raise InputError(f"{path} is not JSON ({error}); correct it.") from None
    if not isinstance(edits, dict):
        raise InputError(f"{path} is not a JSON object of lights' names; see the manual.")
    for name, values in edits.items():
        if values is not None and not isinstance(values, dict):
            raise InputError(
                f"{path}: light '{name}' needs an object of attributes, or null to switch it off."
            )
    return edits
