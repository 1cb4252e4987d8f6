# SPDX-License-Identifier: GPL-3.0-or-later
"""Has panels drawn again when a camera changed: Blender does so only in the object's own tabs."""

from __future__ import annotations

from typing import Any

import bpy


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _redraw_panels(_scene: Any, depsgraph: Any) -> None:
    if any(_is_camera(update.id) for update in depsgraph.updates):
        redraw({"PROPERTIES"})


def _is_camera(changed: Any) -> bool:
    """Whether it is one, or what several of them hang on, or a collection that lost or got one."""
    if isinstance(changed, bpy.types.Object):
        return changed.type in {"CAMERA", "EMPTY"}
    return isinstance(changed, bpy.types.Camera | bpy.types.Collection)


def redraw(kinds: set[str]) -> None:
    """Have all areas of these kinds drawn again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in kinds:
                area.tag_redraw()


def register() -> None:
    bpy.app.handlers.depsgraph_update_post.append(_redraw_panels)


def unregister() -> None:
    handlers = bpy.app.handlers.depsgraph_update_post
    if _redraw_panels in handlers:  # a script may have cleared the list
        handlers.remove(_redraw_panels)
