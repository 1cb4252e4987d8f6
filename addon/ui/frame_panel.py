# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame graph of the viewport that was drawn last: each pass, its state and its time."""

from __future__ import annotations

from typing import Any

import bpy

from ..relight.graph.frame_graph import FrameGraph
from . import shown_graph
from .render_panel import RenderPanel


def lines(graph: FrameGraph) -> list[tuple[str, str, str]]:
    """(icon, pass, time) of every pass, in order; the icon tells whether it has to run."""
    rows = []
    for each in graph.passes:
        seconds = graph.seconds(each.name)
        took = "" if seconds is None else f"{1000.0 * seconds:.1f} ms"
        icon = "RADIOBUT_ON" if graph.is_dirty(each.name) else "CHECKMARK"
        rows.append((icon, each.name, took))
    return rows


class RELUME_PT_frame(RenderPanel, bpy.types.Panel):
    """What is drawn for a picture, and what of it an edit made dirty."""

    bl_label = "Frame Graph"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:  # noqa: ARG002
        graph = shown_graph.current()
        if graph is None:
            self.layout.label(text="Switch a 3D viewport to Rendered shading", icon="INFO")
            return
        times = shown_graph.current_times()
        if times is not None:
            steps = self.layout.column(align=True)
            for text, took in times.lines():
                row = steps.split(factor=0.75)
                row.label(text=f"{text} picture", icon="IMAGE_DATA")
                row.label(text=took)
        column = self.layout.column(align=True)
        for icon, text, took in lines(graph):
            row = column.split(factor=0.75)
            row.label(text=text, icon=icon)
            row.label(text=took)


def register() -> None:
    bpy.utils.register_class(RELUME_PT_frame)


def unregister() -> None:
    """The graph goes with the viewport; nothing of it stays."""
    shown_graph.show(None)
    bpy.utils.unregister_class(RELUME_PT_frame)
