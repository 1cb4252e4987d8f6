# SPDX-License-Identifier: GPL-3.0-or-later
"""Relume inside Blender: properties, operators, panels and the render engine.

The engine's final render and its viewports go through `scene_session`, which holds the one
`RelightSession`. Place and Bake run in a background Blender (`job`), so that the artist's own
file, selection, undo history and render settings are never touched.
"""

from __future__ import annotations

from . import (
    camera_watch,
    engine,
    frame_panel,
    hole_panel,
    light_mixer,
    light_nodes_watch,
    light_objects,
    light_outlines,
    light_panels,
    operators,
    panels,
    properties,
    surface_edit_watch,
    surface_panels,
    surface_properties,
    visibility_panel,
    write_back_operators,
)

_MODULES = (
    properties,
    surface_properties,
    operators,
    engine,
    panels,
    hole_panel,
    light_panels,
    light_objects,
    write_back_operators,
    light_mixer,
    light_outlines,
    frame_panel,
    surface_panels,
    visibility_panel,
    surface_edit_watch,
    camera_watch,
    light_nodes_watch,
)


def register() -> None:
    """Register everything, in order of dependence."""
    for module in _MODULES:
        module.register()


def unregister() -> None:
    """Undo register(), last things first; a bake under way is stopped."""
    for module in reversed(_MODULES):
        module.unregister()
