# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame graph as the manual has it: `python -m tools.frame_chart` prints it."""

from __future__ import annotations

from addon.relight.graph.frame_graph import FrameGraph
from addon.relight.graph.frame_passes import LightNode, frame_passes


def frame_chart() -> str:
    """A Mermaid chart of a view under a spot with shadows and a fill light without."""
    lights = (
        LightNode("Key", casts=True, follows_view=False),
        LightNode("Fill", casts=False, follows_view=False),
    )
    return FrameGraph(frame_passes(lights, has_emission=False)).mermaid()


if __name__ == "__main__":
    print(frame_chart(), end="")
