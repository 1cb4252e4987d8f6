# SPDX-License-Identifier: GPL-3.0-or-later
"""The dependency graph as a render sees it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ..errors import InputError


class _DepsgraphProbe(bpy.types.RenderEngine):
    """A render engine that draws nothing: Blender hands it the graph as a render sees it."""

    bl_idname = "RELUME_PROBE"
    bl_label = "Relume Probe"
    bl_use_postprocess = False

    callback: Callable[[Any], None] | None = None
    failure: BaseException | None = None

    def render(self, depsgraph: Any) -> None:
        # Blender prints and swallows what an engine raises, so it is handed on by hand.
        try:
            if _DepsgraphProbe.callback is not None:
                _DepsgraphProbe.callback(depsgraph)
        except BaseException as failure:  # noqa: BLE001
            _DepsgraphProbe.failure = failure


def viewport_depsgraph(scene: Any) -> Any:
    """The scene's dependency graph as its viewports see it, evaluated now."""
    with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
        return bpy.context.evaluated_depsgraph_get()


def with_render_depsgraph[T](scene: Any, function: Callable[[Any], T]) -> T:
    """Call `function` with the scene's dependency graph evaluated for a render.

    The graph that Python can ask for directly is the viewport's, with other modifier levels
    and other hidden objects. Only for background use: it runs a render of `scene`, whose
    engine is put back afterwards.
    """
    results: list[T] = []
    engine = scene.render.engine
    bpy.utils.register_class(_DepsgraphProbe)
    _DepsgraphProbe.callback = lambda depsgraph: results.append(function(depsgraph))
    _DepsgraphProbe.failure = None
    try:
        scene.render.engine = _DepsgraphProbe.bl_idname
        bpy.ops.render.render(scene=scene.name)
        if _DepsgraphProbe.failure is not None:
            raise _DepsgraphProbe.failure
    finally:
        scene.render.engine = engine
        _DepsgraphProbe.callback = None
        _DepsgraphProbe.failure = None
        bpy.utils.unregister_class(_DepsgraphProbe)
    if not results:
        raise InputError(f"scene '{scene.name}' could not be evaluated for rendering")
    return results[0]
