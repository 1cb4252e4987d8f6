# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets Blender's own panels show under Relume's render engine."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

# Listed for the built-in engine, but about what Relume does not have, or replaced below.
_EXCLUDED = {
    "DATA_PT_light",
    "NODE_DATA_PT_light",
    "RENDER_PT_freestyle",
    "RENDER_PT_simplify",
    "RENDER_PT_simplify_greasepencil",
    "VIEWLAYER_PT_freestyle",
}
# EEVEE's, which show exactly what Relume reads. Cycles' own panels share one set of engines, so
# that adding to one would show them all, its sampling included.
_OF_EEVEE = {
    "DATA_PT_EEVEE_light",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
    "MATERIAL_PT_preview",
    "NODE_DATA_PT_EEVEE_light",
}


def _panels() -> Iterator[Any]:
    for panel in bpy.types.Panel.__subclasses__():
        engines: set[str] = getattr(panel, "COMPAT_ENGINES", set())
        shared = "BLENDER_RENDER" in engines and panel.__name__ not in _EXCLUDED
        if shared or panel.__name__ in _OF_EEVEE:
            yield panel


def register(engine: str) -> None:
    """Add the engine's bl_idname to the panels that it can use."""
    for panel in _panels():
        panel.COMPAT_ENGINES.add(engine)


def unregister(engine: str) -> None:
    """Take it out of every panel again."""
    for panel in bpy.types.Panel.__subclasses__():
        getattr(panel, "COMPAT_ENGINES", set()).discard(engine)
