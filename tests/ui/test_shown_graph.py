# SPDX-License-Identifier: GPL-3.0-or-later
"""The Frame Graph panel follows the picture that a viewport draws."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from addon.relight.graph.frame_graph import FrameGraph
from addon.ui import shown_graph
from addon.ui.progressive_picture import PictureTimes


def test_the_panel_is_drawn_again_when_a_step_of_the_picture_came(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[Callable[[], float | None]] = []
    drawn: list[set[str]] = []
    monkeypatch.setattr(shown_graph, "call_later", lambda function, _: asked.append(function))
    monkeypatch.setattr(shown_graph, "redraw", drawn.append)
    graph, times = FrameGraph([]), PictureTimes()
    counts = []
    for step in ("", "first", "full", "", "last", ""):
        if step:
            setattr(times, step, 1.0)
        shown_graph.show(graph, times)
        counts.append(len(asked))
    assert counts == [1, 2, 3, 3, 4, 4]
    assert shown_graph.current_times() is times
    # Always the same function: a timer that is there is not set again.
    assert len(set(asked)) == 1
    assert asked[0]() is None
    assert drawn == [{"PROPERTIES"}]
    shown_graph.show(None)
    assert shown_graph.current() is None
    assert len(asked) == 4
