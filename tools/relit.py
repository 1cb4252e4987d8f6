# SPDX-License-Identifier: GPL-3.0-or-later
"""The open scene relit from its cache: what the relight and evaluate verbs share."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from addon.errors import InputError
from addon.progress import Progress, silent
from addon.scene.exposure import Exposure
from addon.scene.geometry import SceneGeometry
from addon.scene.light import Light
from addon.scene.light_linking import LightLinking
from addon.scene.render_region import RenderRegion
from addon.scene.surface_edit import NO_EDITS, SurfaceEdits
from addon.scene.view import View
from addon.scene.world import World

if TYPE_CHECKING:
    from addon.relight.session import RelightSession
    from addon.relight.shadows.shadow_frustum import ShadowMethod


@dataclass(frozen=True)
class SceneArrays:
    """Everything that the session needs of a scene, as a render would see it.

    Attributes:
        geometry: its surfaces.
        lights: what is lit.
        world: None when it is black, unless the film lets it through.
        warnings: one sentence for each thing left out or approximated.
        frame: at which it was read.
        surface_edits: that the .blend keeps.
        emitter_linking: of objects that may glow, by their names.
        mute_world, mute_emission: whether the .blend leaves these out of the picture.
        solo_objects, mute_objects: names of glowing objects whose light is shown alone, or left
            out.
    """

    geometry: SceneGeometry
    lights: tuple[Light, ...]
    world: World | None
    warnings: tuple[str, ...]
    frame: int
    surface_edits: SurfaceEdits = NO_EDITS
    emitter_linking: Mapping[str, LightLinking] = field(default_factory=dict)
    mute_world: bool = False
    mute_emission: bool = False
    solo_objects: tuple[str, ...] = ()
    mute_objects: tuple[str, ...] = ()


def read_scene(scene: Any) -> SceneArrays:
    """Read the open scene, a `bpy.types.Scene`, at its current frame.

    Raises:
        InputError: there is no mesh.
    """
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.geometry_reader import read_geometry
    from addon.scene.light_linking_reader import read_emitter_linking
    from addon.scene.light_profile_reader import ensure_measured
    from addon.scene.light_reader import read_lights, read_muted
    from addon.scene.surface_edit_reader import read_surface_edits
    from addon.scene.world_reader import read_world, world_warnings

    def read(depsgraph: Any) -> SceneArrays:
        geometry, world = read_geometry(depsgraph), read_world(depsgraph)
        lights = tuple(read_lights(depsgraph))
        warnings = [*geometry.warnings, *(w for light in lights for w in light.warnings)]
        warnings += world_warnings(depsgraph)
        frame, edits = int(scene.frame_current), read_surface_edits(depsgraph)
        linking = read_emitter_linking(depsgraph)
        return SceneArrays(
            geometry, lights, world, tuple(warnings), frame, edits, linking, *read_muted(scene)
        )

    ensure_measured(scene)
    return with_render_depsgraph(scene, read)


def mixed(arrays: SceneArrays, solo: Sequence[str], mute: Sequence[str]) -> SceneArrays:
    """The scene with some lights and glowing objects alone, or without some.

    Args:
        arrays: the scene; what its own lights say of solo and mute counts where `solo` is empty.
        solo: names of lights, or of objects that may glow.
        mute: names of lights, or of objects that may glow.

    Raises:
        InputError: a name is none of the lights that shine, and no object's.
    """
    known = [light.name for light in arrays.lights]
    objects = set(arrays.geometry.object_names) - set(known)
    for name in (*solo, *mute):
        if name not in known and name not in objects:
            some = ", ".join(known) or "none"
            raise InputError(
                f"there is no light '{name}' that shines, and no object of that name that might "
                f"glow; the lights are: {some}"
            )
    lights = tuple(
        replace(
            light,
            solo=light.name in solo if solo else light.solo,
            mute=light.mute or light.name in mute,
        )
        for light in arrays.lights
    )
    return replace(
        arrays,
        lights=lights,
        solo_objects=tuple(name for name in solo if name in objects),
        mute_objects=tuple(name for name in mute if name in objects),
    )


def unmixed(arrays: SceneArrays) -> SceneArrays:
    """The scene with all of its light, as Cycles shows it: solo and mute are Relume's own."""
    lights = tuple(replace(light, solo=False, mute=False) for light in arrays.lights)
    return replace(arrays, lights=lights, mute_world=False, mute_emission=False)


def read_lights_again(scene: Any) -> tuple[Light, ...]:
    """The lights alone, after an edit."""
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.light_profile_reader import ensure_measured
    from addon.scene.light_reader import read_lights

    ensure_measured(scene)
    return with_render_depsgraph(scene, lambda depsgraph: tuple(read_lights(depsgraph)))


def read_views(
    scene: Any, cameras: Sequence[str | None], size: tuple[int, int] | None = None
) -> tuple[View, ...]:
    """The views of cameras at the scene's current frame.

    Args:
        scene: a `bpy.types.Scene`.
        cameras: names of camera objects; None for the scene's active one.
        size: width and height in pixels; None for the scene's render size.

    Raises:
        InputError: there is no such camera, or Relume cannot show its kind.
    """
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.view_reader import find_camera, read_view

    objects = [find_camera(scene, name) for name in cameras]

    def read(depsgraph: Any) -> tuple[View, ...]:
        return tuple(read_view(depsgraph, camera, *(size or ())) for camera in objects)

    return with_render_depsgraph(scene, read)


def read_region(scene: Any, view: View) -> RenderRegion | None:
    """The part of a view of `read_views` that the scene's renders are of; None for all.

    Raises:
        InputError: it has no pixel.
    """
    from addon.scene.view_reader import read_render_region

    return read_render_region(scene.render, view)


def read_exposure_of(
    scene: Any, view: View, geometry: SceneGeometry, region: RenderRegion | None = None
) -> Exposure | None:
    """What moves while the shutter of a view's camera is open; None without motion blur.

    The scene is evaluated at several times, and then at its frame again.

    Args:
        scene: a `bpy.types.Scene`.
        view: of `read_views`, or a region of that.
        geometry: of `read_scene`, at the same frame.
        region: the same; None for all.
    """
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.exposure_reader import read_exposure
    from addon.scene.view_reader import find_camera

    if not scene.render.use_motion_blur:
        return None
    frame, part = scene.frame_current, scene.frame_subframe

    def read_at(time: float, read: Callable[[Any], Any]) -> Any:
        whole = math.floor(time)
        scene.frame_set(whole, subframe=time - whole)
        return with_render_depsgraph(scene, read)

    try:
        camera = find_camera(scene, view.name)
        return read_exposure(scene, camera, view, geometry, read_at, region=region)
    finally:
        scene.frame_set(frame, subframe=part)


def camera_names(scene: Any) -> list[str | None]:
    """The names of a shot's cameras; without any, None, which `read_views` refuses."""
    from addon.scene.caching_collection_reader import shot_cameras

    return [camera.name for camera in shot_cameras(scene)] or [None]


def require_light(scene: Any, arrays: SceneArrays) -> None:
    """Raises InputError when nothing gives light, in what was read or in the scene unedited."""
    dark = arrays.world is None or arrays.world.is_black
    if dark and not arrays.lights and not read_lights_again(scene):
        raise InputError(f"Scene '{scene.name}' has no light; add one to relight it.")


def open_session(
    arrays: SceneArrays,
    cache: Path,
    samples: int,
    progress: Progress = silent,
    *,
    split_lobes: bool = False,
    shadows: ShadowMethod = "auto",
) -> RelightSession:
    """A session on a scene's cache, with the scene's lights and world.

    Args:
        arrays: the scene.
        cache: the cache's folder.
        samples: of a finished picture's pixel.
        progress: is told how far loading the cache is.
        split_lobes: see `RelightSession`.
        shadows: how they are found.

    Raises:
        InputError: there is no such cache, it is damaged, it was baked from another scene or not
            at this frame; or there is no driver to draw with; or an object that is to be shown
            alone, or left out, does not glow.
    """
    from addon.relight.session import RelightSession
    from addon.relight.shadows.shadow_frustum import ShadowSettings

    from .cache_check import check_cache
    from .gpu_context import open_gpu

    store = check_cache(arrays.geometry, cache, arrays.frame)
    open_gpu()
    session = RelightSession(
        arrays.geometry,
        store,
        samples,
        ShadowSettings(method=shadows),
        split_lobes=split_lobes,
        progress=progress,
    )
    session.set_emitter_linking(arrays.emitter_linking)
    session.set_glow_mix(arrays.solo_objects, arrays.mute_objects)
    session.set_lights(arrays.lights)
    session.set_world(arrays.world)
    session.set_muted(world=arrays.mute_world, emission=arrays.mute_emission)
    return session


def cache_approximations(cache: Path) -> list[str]:
    """A sentence for each material that a cache does not hold as Cycles shows it."""
    from addon.caching.store import CacheStore

    return [str(item) for item in CacheStore.open(cache).plan.approximations]
