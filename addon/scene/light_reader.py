# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a dependency graph's lights into `Light`s."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .light import NARROWEST_SPREAD, Light
from .light_controls_reader import read_controls
from .light_linking import LightLinking
from .light_linking_reader import LinkingReader
from .light_nodes_reader import (
    MeasuredNodes,
    UnmeasuredLight,
    constant_emission,
    known,
    measured_before,
    measuring_key,
)
from .written_light import is_visible

# W/sr: with it, the radiance of a surface a micrometre away is still a float32.
_BRIGHTEST = 1e25


def read_lights(depsgraph: Any) -> tuple[Light, ...]:
    """The lights that a render of this dependency graph has, instances too.

    Their names are unique. A light that is hidden from renders, black, flat (scaled to nothing)
    or a portal is left out. Take the graph of a
    render (`with_render_depsgraph`): the viewport's does not know what collections hide.
    """
    lights = (_with_nodes(light, data) for light, data in _without_nodes(depsgraph))
    return tuple(_finite(light) for light in lights if light.is_lit)


def _finite(light: Light) -> Light:
    """The light, or where pictures cannot hold what it sends, one without light that says so."""
    if (np.abs(light.intensity) < _BRIGHTEST).all():  # False for what is no number, too
        return light
    refused = f"light '{light.name}': its colour or power is beyond all measure; it gives no light"
    dark = replace(light, energy=0.0, exposure=0.0, color=np.zeros(3))
    return replace(dark, warnings=(*light.warnings, refused))


def read_muted(scene: Any) -> tuple[bool, bool]:
    """Whether a `bpy.types.Scene` leaves out its world's light, and what surfaces send out."""
    return _switch(scene, "mute_world"), _switch(scene, "mute_emission")


def unmeasured_lights(depsgraph: Any) -> tuple[UnmeasuredLight, ...]:
    """The lights whose nodes `measure_lights` has to look at before `read_lights` knows them."""
    found: dict[str, UnmeasuredLight] = {}
    for light, data in _without_nodes(depsgraph):
        if light.is_lit and constant_emission(data) is None:
            key = measuring_key(data, light)
            if known(key) is None:
                found[key] = UnmeasuredLight(key, data.original, light)
    return tuple(found.values())


def _without_nodes(depsgraph: Any) -> Iterator[tuple[Light, Any]]:
    """Each light as it would be without its nodes, and the evaluated `bpy.types.Light`."""
    names: set[str] = set()
    linking = LinkingReader(depsgraph)
    for instance in depsgraph.object_instances:
        evaluated = instance.object
        if evaluated.type != "LIGHT" or not instance.show_self:
            continue
        original = evaluated.original
        if original.hide_render or _is_portal(evaluated.data):
            continue
        name = original.name
        if instance.is_instance and instance.parent is not None:
            name = f"{instance.parent.original.name}/{name}"
        name = _unique(name, names)
        world_from_light = np.array(instance.matrix_world, dtype=np.float64)
        if not np.isfinite(world_from_light).all() or not world_from_light.any(axis=0).all():
            continue
        names.add(name)
        light = _read_light(name, evaluated, world_from_light, linking.of(evaluated))
        yield _with_controls(depsgraph, light, evaluated.data), evaluated.data


def _with_controls(depsgraph: Any, light: Light, data: Any) -> Light:
    problems: list[str] = []
    controls = read_controls(depsgraph, data, problems)
    told = (f"light '{light.name}': {problem}" for problem in problems)
    return replace(light, controls=controls, warnings=(*light.warnings, *told))


def _unique(name: str, taken: set[str]) -> str:
    number, unique = 1, name
    while unique in taken:
        number += 1
        unique = f"{name} #{number}"
    return unique


def _is_portal(data: Any) -> bool:
    cycles = getattr(data, "cycles", None)
    return data.type == "AREA" and cycles is not None and bool(cycles.is_portal)


def _read_light(
    name: str, evaluated: Any, world_from_light: NDArray[np.float64], linking: LightLinking
) -> Light:
    data = evaluated.data
    problems: list[str] = []
    color = np.array(data.color, dtype=np.float64)
    if data.use_temperature:
        color *= np.array(data.temperature_color, dtype=np.float64)
    spread = _spread(data, problems)
    mute, solo = _mix(evaluated.original)
    if evaluated.visible_camera:
        problems.append("it is visible to cameras, which is not shown")
    return Light(
        name=name,
        type=data.type,
        world_from_light=world_from_light,
        energy=float(data.energy),
        color=color,
        exposure=float(data.exposure),
        normalize=bool(data.normalize),
        shadow_soft_size=float(data.shadow_soft_size) if data.type in ("POINT", "SPOT") else 0.0,
        use_soft_falloff=bool(getattr(data, "use_soft_falloff", True)),
        spot_size=float(getattr(data, "spot_size", np.pi)),
        spot_blend=float(getattr(data, "spot_blend", 0.0)),
        angle=float(getattr(data, "angle", 0.0)),
        shape=getattr(data, "shape", "SQUARE"),
        size=float(getattr(data, "size", 1.0)),
        size_y=float(getattr(data, "size_y", 1.0)),
        spread=spread,
        diffuse_factor=float(is_visible(evaluated, "visible_diffuse")),
        specular_factor=float(is_visible(evaluated, "visible_glossy")),
        use_shadow=bool(data.use_shadow),
        linking=linking,
        mute=mute,
        solo=solo,
        warnings=tuple(f"light '{name}': {problem}" for problem in problems),
    )


def _mix(light: Any) -> tuple[bool, bool]:
    """Whether a light object is mute, and whether solo."""
    return _switch(light, "mute"), _switch(light, "solo")


def _switch(block: Any, name: str) -> bool:
    """One of Relume's switches of a data-block.

    Also where the extension's properties are not registered, as on the command line.
    """
    if hasattr(block, "relume"):
        return bool(getattr(block.relume, name))
    kept = block.bl_system_properties_get()
    group = (None if kept is None else kept.get("relume")) or {}
    return bool(group.get(name, False))


def _spread(data: Any, problems: list[str]) -> float:
    spread = float(getattr(data, "spread", np.pi))
    if spread < NARROWEST_SPREAD:
        problems.append("its spread is below one degree and is shaded as one degree")
        return NARROWEST_SPREAD
    # Blender keeps angles in float32, whose pi is a little above.
    return min(spread, float(np.pi)) if spread < np.float32(np.pi) else float(np.pi)


def _with_nodes(light: Light, data: Any) -> Light:
    """The light with what its nodes make of it."""
    constant = constant_emission(data)
    if constant is not None:
        return replace(light, color=light.color * constant)
    measured = known(measuring_key(data, light))
    unmeasured: tuple[str, ...] = ()
    if measured is None:
        measured = measured_before(light.name)
        unmeasured = ("its nodes changed, and are shown as they were",)
    if measured is None:
        measured = MeasuredNodes(np.ones(3))
        unmeasured = ("its nodes are not measured yet; its power and colour alone are used",)
    problems = (f"light '{light.name}': {problem}" for problem in (*measured.problems, *unmeasured))
    return replace(
        light,
        color=light.color * measured.color,
        profile=measured.profile,
        warnings=(*light.warnings, *problems),
    )
