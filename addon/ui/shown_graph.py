# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame graph of the viewport that was drawn last, and the times of its picture."""

from __future__ import annotations

from dataclasses import replace

from ..relight.graph.frame_graph import FrameGraph
from .camera_watch import redraw
from .event_loop import call_later
from .progressive_picture import PictureTimes

# The panel that lists them is drawn again no sooner after a change, in seconds.
_REFRESH_S = 0.25


class _Shown:
    graph: FrameGraph | None = None
    times: PictureTimes | None = None
    before: PictureTimes | None = None


def show(graph: FrameGraph | None, times: PictureTimes | None = None) -> None:
    """Keep these, and have the panel show them when a step of the picture came; None when their
    viewport is gone."""
    _Shown.graph, _Shown.times = graph, times
    # The times are the viewport's own, which it goes on filling in.
    if times is not None and times != _Shown.before:
        _Shown.before = replace(times)
        call_later(_refresh, _REFRESH_S)


def _refresh() -> None:
    redraw({"PROPERTIES"})


def current() -> FrameGraph | None:
    """The graph that was kept last."""
    return _Shown.graph


def current_times() -> PictureTimes | None:
    """The times that were kept last."""
    return _Shown.times
