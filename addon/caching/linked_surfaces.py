# SPDX-License-Identifier: GPL-3.0-or-later
"""Local stand-ins for surfaces that are linked from libraries.

Blender refuses to let linked data use local data, so an instrumented material cannot take the
place of its original on a linked mesh. It can on a local copy of that mesh, used by a local
copy of its object, in a local copy of its collection: while these stand in, every way from a
local scene to a material leads through local data.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

# What can stand between a scene and a material.
_KINDS = ("collections", "objects", "meshes", "curves", "hair_curves", "metaballs", "node_groups")

# What a view layer says about a collection. A parent's `exclude` sets its children's.
_LAYER_FLAGS = ("exclude", "hide_viewport", "holdout", "indirect_only")


@contextmanager
def local_stand_ins() -> Iterator[None]:
    """Local copies of linked surfaces in their place while the block runs.

    Copies share their arrays with the originals, so that this takes little memory. Afterwards
    every user has the linked data again, and the copies are gone. One trace remains until the
    file is opened anew: Blender takes the linked data for used directly
    (`is_library_indirect` is false).
    """
    linked_blocks = _linked_blocks()
    if not linked_blocks:
        yield
        return
    flags, shown = _collection_flags(), _object_states()
    swapped: list[tuple[Any, Any]] = []
    try:
        for linked in linked_blocks:
            copy = linked.copy()
            copy.use_fake_user = False
            swapped.append((linked, copy))
        for linked, copy in swapped:
            linked.user_remap(copy)
        _set_collection_flags(flags)
        yield
    finally:
        for linked, copy in reversed(swapped):
            copy.user_remap(linked)
        bpy.data.batch_remove([copy for _, copy in swapped])
        _set_collection_flags(flags)
        _set_object_states(shown)


def _linked_blocks() -> list[Any]:
    blocks = [block for kind in _KINDS for block in getattr(bpy.data, kind)]
    return [
        block
        for block in blocks
        if block.library is not None
        and (not isinstance(block, bpy.types.NodeTree) or block.bl_idname == "GeometryNodeTree")
    ]


# A replaced collection loses what the view layers say about it, and a replaced object its
# selection: these are kept by their place.

_Flags = dict[tuple[int, ...], tuple[bool, ...]]
_States = dict[tuple[str, str, str], tuple[bool, bool]]


def _view_layers() -> list[Any]:
    return [layer for scene in bpy.data.scenes for layer in scene.view_layers]


def _collection_flags() -> _Flags:
    """The flags of every layer collection, parents before their children."""
    flags: _Flags = {}
    pending: list[tuple[tuple[int, ...], Any]] = [
        ((index,), layer.layer_collection) for index, layer in enumerate(_view_layers())
    ]
    while pending:
        place, collection = pending.pop()
        flags[place] = tuple(bool(getattr(collection, name)) for name in _LAYER_FLAGS)
        pending += [((*place, i), child) for i, child in enumerate(collection.children)]
    return flags


def _set_collection_flags(flags: _Flags) -> None:
    for place, values in flags.items():
        # Found anew for each, as setting one rebuilds the others.
        collection = _view_layers()[place[0]].layer_collection
        for index in place[1:]:
            collection = collection.children[index]
        for name, value in zip(_LAYER_FLAGS, values, strict=True):
            if getattr(collection, name) != value:
                setattr(collection, name, value)


def _object_states() -> _States:
    """Whether linked objects are selected and hidden, by scene, view layer and object."""
    return {
        (layer.id_data.name_full, layer.name, obj.name_full): (
            obj.select_get(view_layer=layer),
            obj.hide_get(view_layer=layer),
        )
        for layer in _view_layers()
        for obj in layer.objects
        if obj.library is not None
    }


def _set_object_states(states: _States) -> None:
    for layer in _view_layers():
        for obj in layer.objects:
            state = states.get((layer.id_data.name_full, layer.name, obj.name_full))
            if state is not None and state != (
                obj.select_get(view_layer=layer),
                obj.hide_get(view_layer=layer),
            ):
                obj.hide_set(False, view_layer=layer)
                obj.select_set(state[0], view_layer=layer)
                obj.hide_set(state[1], view_layer=layer)
