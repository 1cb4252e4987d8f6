# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells edits of surfaces from other changes of the same objects and materials.

Blender's dependency graph reports an object that has an add-on's property changed as if it had
moved and changed its shape, and a material as if it had to be baked. Reading a scene's shapes for
that at each step of a slider would take seconds; the properties tell of themselves instead.
"""

from __future__ import annotations

from typing import Any

import bpy

# Blender's classes that have edits.
OWNERS = (bpy.types.Material, bpy.types.Object)

# Of each block that was edited since the last evaluation, and in it, by session_uid: where an
# object was at the edit.
_waiting: dict[int, Any] = {}
_evaluated: dict[int, Any] = {}


def note_edit(group: Any, _context: Any) -> None:
    """A property of a block's edit was set: `update` of the properties."""
    block = group.id_data
    if not block.is_evaluated:
        _waiting.setdefault(block.session_uid, _place(block))


def is_edit_alone(block: Any) -> bool:
    """Whether all that changed about an evaluated block in the last evaluation is its edit.

    A script that sets an edit and changes the object's modifiers at once is taken for an edit.
    """
    uid = block.original.session_uid
    return uid in _evaluated and _evaluated[uid] == _place(block)


def _place(block: Any) -> Any:
    return block.matrix_world.copy() if isinstance(block, bpy.types.Object) else None


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _evaluate(*_: Any) -> None:
    """An evaluation begins."""
    _evaluated.clear()
    _evaluated.update(_waiting)
    _waiting.clear()


@bpy.app.handlers.persistent  # type: ignore[untyped-decorator]
def _forget(*_: Any) -> None:
    """The scene comes to another frame, or is another: anything may change."""
    _evaluated.clear()
    _waiting.clear()


def _handlers() -> tuple[tuple[list[Any], Any], ...]:
    handlers = bpy.app.handlers
    return (
        (handlers.depsgraph_update_pre, _evaluate),
        (handlers.frame_change_pre, _forget),
        (handlers.load_pre, _forget),
        (handlers.undo_pre, _forget),
        (handlers.redo_pre, _forget),
    )


def register() -> None:
    """Watch."""
    for handlers, handler in _handlers():
        handlers.append(handler)


def unregister() -> None:
    """Watch no longer."""
    for handlers, handler in _handlers():
        handlers.remove(handler)
    _forget()
