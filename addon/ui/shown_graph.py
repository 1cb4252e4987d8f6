# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame graph of the viewport that was drawn last."""

from __future__ import annotations

from ..relight.graph.frame_graph import FrameGraph


class _Shown:
    graph: FrameGraph | None = None


def show(graph: FrameGraph | None) -> None:
    """Keep this graph; None when its viewport is gone."""
    _Shown.graph = graph


def current() -> FrameGraph | None:
    """The graph that was kept last."""
    return _Shown.graph
