# SPDX-License-Identifier: GPL-3.0-or-later
"""A render's work in the interface's thread: done there, one piece after the other, or given up."""

from __future__ import annotations

import threading
import time
import weakref
from collections.abc import Callable
from typing import Any

import bpy
import pytest

from addon.progress import Cancelled
from addon.ui.main_thread import MainThread


def never() -> bool:
    return False


@pytest.fixture
def timers(monkeypatch: pytest.MonkeyPatch) -> list[Callable[[], float | None]]:
    """Blender's timers, which a module has no event loop for."""
    registered: list[Callable[[], float | None]] = []
    monkeypatch.setattr(bpy.app.timers, "register", registered.append)
    return registered


def in_a_render(render: Callable[[], None]) -> threading.Thread:
    thread = threading.Thread(target=render, daemon=True)
    thread.start()
    return thread


def run_until_ended(timers: list[Callable[[], float | None]], thread: threading.Thread) -> int:
    """The interface's event loop; how often it came round."""
    rounds, end = 0, time.monotonic() + 20.0
    while thread.is_alive() or timers:
        assert time.monotonic() < end
        for timer in list(timers):
            if timer() is None:
                timers.remove(timer)
        rounds += 1
        time.sleep(0.001)
    return rounds


def test_work_is_done_at_once_where_the_render_is_in_that_thread(
    timers: list[Callable[[], float | None]],
) -> None:
    with MainThread(never) as main:
        assert main.do(lambda: 3) == 3
    assert timers == []


def test_work_of_a_render_is_done_by_the_interface(
    timers: list[Callable[[], float | None]],
) -> None:
    done: list[Any] = []

    def render() -> None:
        with MainThread(never) as main:
            done.extend(main.do(threading.current_thread) for _ in range(3))
            with pytest.raises(ZeroDivisionError):
                main.do(lambda: 1 // 0)
        done.append(threading.current_thread())

    # Windows are drawn between two pieces of work.
    assert run_until_ended(timers, in_a_render(render)) > 3
    assert done[:3] == [threading.main_thread()] * 3
    assert done[3] is not threading.main_thread()


def test_a_render_that_is_cancelled_waits_for_nothing(
    timers: list[Callable[[], float | None]],
) -> None:
    """An interface that ends waits for the render, and does nothing for it any more."""
    seen: list[str] = []
    cancelled = threading.Event()

    def render() -> None:
        with MainThread(cancelled.is_set) as main:
            try:
                main.do(lambda: seen.append("done"))
            except Cancelled:
                seen.append("cancelled")

    thread = in_a_render(render)
    time.sleep(0.05)
    cancelled.set()
    thread.join(5.0)
    assert not thread.is_alive()
    assert seen == ["cancelled"]
    # What was given up is not done afterwards.
    run_until_ended(timers, thread)
    assert seen == ["cancelled"]


def test_what_ends_a_render_is_done_though_it_was_cancelled(
    timers: list[Callable[[], float | None]],
) -> None:
    """By the interface, once it comes to it: what is on the GPU is freed where it was made."""
    seen: list[threading.Thread] = []

    def render() -> None:
        with MainThread(lambda: True) as main:
            main.finish(lambda: seen.append(threading.current_thread()))

    thread = in_a_render(render)
    thread.join(5.0)
    assert not thread.is_alive()
    assert seen == []
    run_until_ended(timers, thread)
    assert seen == [threading.main_thread()]


def test_an_error_takes_nothing_along_to_the_render(
    timers: list[Callable[[], float | None]],
) -> None:
    freed: list[threading.Thread] = []

    class Drawn:
        """Something on the GPU."""

    def note() -> None:
        freed.append(threading.current_thread())

    def draw() -> None:
        drawn = Drawn()
        weakref.finalize(drawn, note)
        try:
            raise RuntimeError("no room")
        except RuntimeError as error:
            raise ValueError("a picture is too large") from error

    def render() -> None:
        with MainThread(never) as main, pytest.raises(ValueError, match="too large"):
            main.do(draw)

    run_until_ended(timers, in_a_render(render))
    assert freed == [threading.main_thread()]
