# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel lists what viewports leave out or approximate, without a session of its own."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from addon.ui import viewport, viewport_warnings
from addon.ui.cache_state import CacheState, read_cache_state
from addon.ui.hole_filler import HoleFiller
from addon.ui.panels import MOST_LINES, draw_state
from addon.ui.progressive_picture import PictureTimes
from addon.ui.viewport import Viewport
from addon.ui.viewport_warnings import ViewportWarnings

FOLDER = Path("/somewhere/shot.relume")


class Opened:
    """In the place of a `SceneSession`; it counts how often it is asked."""

    folder, stale = FOLDER, ()

    def __init__(self, *warnings: str) -> None:
        self.given = warnings
        self.asked = 0
        self.session: Any = SimpleNamespace(set_samples=lambda _: None)

    @property
    def warnings(self) -> tuple[str, ...]:
        self.asked += 1
        return self.given

    def follow_settings(self, _scene: Any) -> None:
        pass

    def follow_filled(self) -> bool:
        return False


class Column:
    """In the place of a layout: what it shows, line by line."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def box(self) -> Column:
        return self

    def column(self, **_: Any) -> Column:
        return self

    def label(self, *, text: str, icon: str) -> None:
        self.lines.append(text)


@pytest.fixture(autouse=True)
def redrawn(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """What was asked to be called later."""
    calls: list[Any] = []
    monkeypatch.setattr(viewport_warnings, "call_later", lambda *call: calls.append(call))
    yield calls
    gc.collect()
    assert not viewport_warnings.viewport_warnings(FOLDER)


def said() -> tuple[str, ...]:
    return viewport_warnings.viewport_warnings(FOLDER)


def test_a_session_is_asked_once_for_a_whole_picture_and_once_for_a_finished_one(
    redrawn: list[Any],
) -> None:
    opened: Any = Opened("the lists are cut short")
    warnings, times = ViewportWarnings(), PictureTimes()
    warnings.follow(opened, times, "", is_finished=False)
    assert (opened.asked, said()) == (0, ())
    times.full = 0.1
    for _ in range(5):
        warnings.follow(opened, times, "", is_finished=False)
    assert (opened.asked, said()) == (1, ("the lists are cut short",))
    redrawn.clear()
    opened.given = ("the cache takes too much",)
    for _ in range(5):
        warnings.follow(opened, times, "", is_finished=True)
    assert (opened.asked, said()) == (2, ("the cache takes too much",))
    # Panels are drawn again for what is new alone.
    assert len(redrawn) == 1
    warnings.follow(opened, PictureTimes(full=0.1), "holes are left", is_finished=True)
    assert (opened.asked, said()) == (3, ("the cache takes too much", "holes are left"))
    warnings.forget()
    assert said() == ()


def test_several_viewports_say_what_they_share_once() -> None:
    every = [ViewportWarnings(), ViewportWarnings()]
    sessions: list[Any] = [Opened("both", "left"), Opened("both", "right")]
    for warnings, opened in zip(every, sessions, strict=True):
        warnings.follow(opened, PictureTimes(full=0.1), "", is_finished=True)
    assert sorted(said()) == ["both", "left", "right"]
    assert viewport_warnings.viewport_warnings(FOLDER.with_name("other.relume")) == ()
    # One that is closed takes its own along.
    every.pop()
    del warnings
    gc.collect()
    assert said() == ("both", "left")


def test_a_viewport_tells_what_its_session_warns_of(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("viewport_lens", "read_viewport"):
        monkeypatch.setattr(viewport, name, lambda *_: None)
    for name in ("_synchronize", "_show"):
        monkeypatch.setattr(Viewport, name, lambda *_: None)
    monkeypatch.setattr(Viewport, "_refine", lambda *_: False)
    monkeypatch.setattr(Viewport, "_status", lambda *_: "")
    monkeypatch.setattr(HoleFiller, "follow", lambda *_, **__: None)
    shown, opened = Viewport(), Opened("the shadows of panes are grey")
    shown._opened = opened  # type: ignore[assignment]
    shown._picture.times.full = 0.1
    shown._filler.note = "holes are left"
    scene = SimpleNamespace(
        original=None,
        relume=SimpleNamespace(viewport_samples=1, frame_rate="30", show_confidence=False),
    )
    monkeypatch.setattr(viewport, "picture_seconds", lambda _: 0.1)
    engine: Any = SimpleNamespace(update_stats=lambda *_: None)
    context = SimpleNamespace(space_data=None, region_data=None, region=None)
    shown.draw(engine, context, SimpleNamespace(scene=scene))
    assert said() == ("the shadows of panes are grey", "holes are left")
    del shown


def test_the_panel_lists_them_in_lines_of_its_width(extension: None, tmp_path: Path) -> None:
    import bpy

    scene: Any = bpy.context.scene
    scene.relume.cache_folder = str(tmp_path)
    assert read_cache_state(scene).warnings == ()
    opened: Any = Opened(*(f"warning {number} of a long list" for number in range(MOST_LINES + 2)))
    opened.folder = tmp_path
    warnings = ViewportWarnings()
    warnings.follow(opened, PictureTimes(full=0.1), "", is_finished=True)
    for _ in range(3):
        state = read_cache_state(scene)
    assert opened.asked == 1
    column = Column()
    draw_state(column, state, 20)
    start = column.lines.index("In the viewport:") + 1
    assert column.lines[start : start + 2] == ["warning 0 of a long", "list"]
    assert column.lines[-1] == "and 2 more"
    assert len(column.lines) == start + 2 * MOST_LINES + 1
    empty = Column()
    draw_state(empty, CacheState("All is well", "INFO"), 20)
    assert empty.lines == ["All is well"]
