# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that send out nothing, while surfaces are rendered that only a white sky lights.

Their light is left out of the sky's anyway; but for each leaf that a ray passes on its way Cycles
would choose a light, and look through all leaves whether it arrives.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from ..stopping import uninterrupted


@contextmanager
def lights_off() -> Iterator[None]:
    """Dark copies of the file's own lights in their place while the block runs; linked ones stay.

    All of their settings and nodes are the lights' own, which drivers may read: only the link to
    their output is gone.
    """
    swapped: list[tuple[Any, Any]] = []
    try:
        for light in [each for each in bpy.data.lights if each.library is None]:
            dark = light.copy()
            swapped.append((light, dark))
            dark.use_fake_user = False
            _darken(dark)
            light.user_remap(dark)
        yield
    finally:
        with uninterrupted():
            for light, dark in swapped:
                dark.user_remap(light)
            bpy.data.batch_remove([dark for _, dark in swapped])


def _darken(light: Any) -> None:
    """Give a light a shader without a surface: Cycles leaves it out."""
    if light.node_tree is None:
        light.use_nodes = True
    tree = light.node_tree
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeOutputLight":
            for link in list(node.inputs["Surface"].links):
                tree.links.remove(link)
