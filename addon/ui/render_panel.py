# SPDX-License-Identifier: GPL-3.0-or-later
"""What Relume's panels in Properties › Render have in common."""

from __future__ import annotations

from typing import Any

from .engine import ENGINE


class RenderPanel:
    """A panel that is there where Relume is the render engine; mixed into `bpy.types.Panel`."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine == ENGINE
