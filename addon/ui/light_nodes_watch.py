# SPDX-License-Identifier: GPL-3.0-or-later
"""Has lights' nodes measured when they changed.

The engine cannot: Cycles evaluates nodes by rendering, and there is one render at a time. So it is
done a moment after an edit, while nothing else is rendered, and the lights are then read again.
"""

from __future__ import annotations

from typing import Any

import bpy

from ..errors import InputError
from ..scene.light_nodes_reader import constant_emission, forget_names
from .engine import ENGINE

# Seconds after the last edit; a value that is being dragged changes faster.
_PAUSE_S = 0.4


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _note_edit(scene: Any, depsgraph: Any) -> None:
    if scene.render.engine == ENGINE and any(_is_light(update.id) for update in depsgraph.updates):
        _schedule()


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _note_file(*_: Any) -> None:
    forget_names()
    if bpy.context.scene is None or bpy.context.scene.render.engine != ENGINE:
        return
    if bpy.app.background:
        # There are no timers.
        _measure()
    else:
        _schedule()


def _is_light(changed: Any) -> bool:
    if isinstance(changed, bpy.types.Object):
        return changed.type == "LIGHT"
    return isinstance(changed, bpy.types.Light | bpy.types.Scene)


def _schedule() -> None:
    if bpy.app.background:
        return
    if bpy.app.timers.is_registered(_measure):
        bpy.app.timers.unregister(_measure)
    bpy.app.timers.register(_measure, first_interval=_PAUSE_S)


def _measure() -> float | None:
    """Measure what the shown scene lacks; the pause until the next try, or None when it is done."""
    scene = bpy.context.scene
    if scene is None or scene.render.engine != ENGINE:
        return None
    if all(constant_emission(data) is not None for data in bpy.data.lights):
        return None
    if bpy.app.is_job_running("RENDER"):
        return _PAUSE_S
    from ..scene.depsgraph_reader import viewport_depsgraph
    from ..scene.light_profile_reader import measure_lights
    from ..scene.light_reader import unmeasured_lights

    waiting = unmeasured_lights(viewport_depsgraph(scene))
    if not waiting:
        return None
    try:
        measure_lights(scene, waiting)
    except InputError as error:
        # The lights' own warning stays in the interface.
        print(f"Relume: {error}")
        return None
    for each in waiting:
        each.data.update_tag()
    return None


def register() -> None:
    bpy.app.handlers.depsgraph_update_post.append(_note_edit)
    bpy.app.handlers.load_post.append(_note_file)


def unregister() -> None:
    for handlers, handler in (
        (bpy.app.handlers.depsgraph_update_post, _note_edit),
        (bpy.app.handlers.load_post, _note_file),
    ):
        if handler in handlers:  # a script may have cleared the list
            handlers.remove(handler)
    if bpy.app.timers.is_registered(_measure):
        bpy.app.timers.unregister(_measure)
