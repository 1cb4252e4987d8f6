# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame graph of the viewport that was drawn last, and the times of its picture."""

from __future__ import annotations

from ..relight.graph.frame_graph import FrameGraph
from .progressive_picture import PictureTimes


class _Shown:
    graph: FrameGraph | None = None
    times: PictureTimes | None = None


def show(graph: FrameGraph | None, times: PictureTimes | None = None) -> None:
    """Keep these; None when their viewport is gone."""
    _Shown.graph, _Shown.times = graph, times


def current() -> FrameGraph | None:
    """The graph that was kept last."""
    return _Shown.graph


def current_times() -> PictureTimes | None:
    """The times that were kept last."""
    return _Shown.times
