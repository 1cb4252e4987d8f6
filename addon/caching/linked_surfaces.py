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


@contextmanager
def local_stand_ins() -> Iterator[None]:
    """Local copies of linked surfaces in their place while the block runs.

    Copies share their arrays with the originals, so that this takes little memory. Afterwards
    every user has the linked data again, and the copies are gone.
    """
    swapped: list[tuple[Any, Any]] = []
    try:
        for linked in _linked_blocks():
            copy = linked.copy()
            copy.use_fake_user = False
            swapped.append((linked, copy))
        for linked, copy in swapped:
            linked.user_remap(copy)
        yield
    finally:
        for linked, copy in reversed(swapped):
            copy.user_remap(linked)
        bpy.data.batch_remove([copy for _, copy in swapped])


def _linked_blocks() -> list[Any]:
    blocks = [block for kind in _KINDS for block in getattr(bpy.data, kind)]
    return [
        block
        for block in blocks
        if block.library is not None
        and (not isinstance(block, bpy.types.NodeTree) or block.bl_idname == "GeometryNodeTree")
    ]
