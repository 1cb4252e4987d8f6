# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the chosen light's barn doors, slide and blockers into the 3D viewport."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from numpy.typing import NDArray

from ..scene.light import Light
from .engine import ENGINE

Points = NDArray[np.float64]

# Round to the eye from any near; a rectangle's corners are among them.
_STEPS = 128
_COLOR = (1.0, 0.72, 0.25, 0.9)
_EDGE_COLOR = (1.0, 0.72, 0.25, 0.35)

_handlers: list[Any] = []


def outline_points(group: Any, *, edge: bool = False) -> Points:
    """(N, 2) the closed outline of a superellipse's properties, or where its soft edge ends."""
    width, height = group.width, group.height
    if edge:
        width, height = width + group.width_edge, height + group.height_edge
    angle = np.linspace(0.0, 2.0 * np.pi, _STEPS + 1)
    # What rounding leaves of 0 would be much, raised to a small power.
    cosine, sine = np.cos(angle).round(12), np.sin(angle).round(12)
    # An eighth of the way round, where both are the same, is the corner.
    x = np.sign(cosine) * np.abs(cosine) ** group.roundness
    y = np.sign(sine) * np.abs(sine) ** group.roundness
    return np.stack([width * x, height * y], axis=-1)


def light_lines(obj: Any) -> Iterator[tuple[Points, bool]]:
    """The lines of a light object: (N, 3) world space, and whether each is of a soft edge."""
    controls = obj.data.relume
    matrix = np.array(obj.matrix_world, dtype=np.float64)
    light = Light(obj.name, obj.data.type, matrix, 1.0, np.ones(3))
    is_sun = light.type == "SUN"
    if controls.barn_doors.use:
        doors = controls.barn_doors
        for edge in (False, True) if doors.width_edge or doors.height_edge else (False,):
            across = _turned(outline_points(doors, edge=edge), doors.rotation)
            for depth in (0.0, 1.0) if is_sun else (1.0,):
                lean = np.array(doors.shear) * depth
                yield _placed(light, across + lean, depth), edge
            if not edge:
                for corner in across[:: _STEPS // 4][:4]:
                    start = corner if is_sun else np.zeros(2)
                    ends = np.stack([start, corner + np.array(doors.shear)])
                    yield _placed(light, ends, np.array([0.0, 1.0])), False
    if controls.slide.use and controls.slide.image is not None:
        slide = controls.slide
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * 0.5
        across = _turned(corners * np.array(slide.scale), slide.rotation) + np.array(slide.offset)
        yield _placed(light, across, 0.0 if is_sun else 1.0), False
    for item in controls.blockers:
        if item.use and item.object is not None:
            world = np.array(item.object.matrix_world, dtype=np.float64)
            for edge in (False, True) if item.width_edge or item.height_edge else (False,):
                yield outline_points(item, edge=edge) @ world[:3, :2].T + world[:3, 3], edge


def _turned(points: Points, angle: float) -> Points:
    cosine, sine = np.cos(angle), np.sin(angle)
    return points @ np.array([[cosine, sine], [-sine, cosine]])


def _placed(light: Light, across: Points, depth: float | Points) -> Points:
    """(N, 3) of places across the beam at a depth along it."""
    q = np.concatenate([across, np.full((len(across), 1), 0.0)], axis=1)
    q[:, 2] = -np.asarray(depth)
    return np.asarray(q @ light.axes + light.position)


def _draw() -> None:
    context = bpy.context
    obj, space = context.object, context.space_data
    shown = context.engine == ENGINE and space.overlay.show_overlays and space.overlay.show_extras
    if not shown or obj is None or obj.type != "LIGHT" or not obj.select_get():
        return
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    shader.bind()
    gpu.state.blend_set("ALPHA")
    for points, is_edge in light_lines(obj):
        shader.uniform_float("color", _EDGE_COLOR if is_edge else _COLOR)
        batch_for_shader(shader, "LINE_STRIP", {"pos": points.astype(np.float32)}).draw(shader)
    gpu.state.blend_set("NONE")


def register() -> None:
    """Draw in every 3D viewport."""
    if not bpy.app.background:
        _handlers.append(
            bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
        )  # fmt: skip


def unregister() -> None:
    """Draw no more."""
    while _handlers:
        bpy.types.SpaceView3D.draw_handler_remove(_handlers.pop(), "WINDOW")
