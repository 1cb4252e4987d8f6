# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of a viewport's picture, with a session whose samples take a known time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.scene.lens import Lens
from addon.scene.view import View, same_view
from addon.ui.progressive_picture import (
    BUSY_S,
    SETTLE_S,
    PictureTimes,
    ProgressivePicture,
)
from tests.synthetic import looking_at, perspective_view

BUDGET_S = 0.033
SAMPLES = 4


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


class Slow:
    """A session of two lights, whose every sample takes a time for each of the view's pixels."""

    def __init__(self, clock: Clock, seconds: float, pixels: int) -> None:
        self._clock, self._each = clock, seconds / pixels
        self._view: View | None = None
        self._drawn = [0, 0]
        self.compiling = ""
        self.announces: list[str] = []
        self.sizes: list[int] = []

    def set_view(self, view: View) -> None:
        if self._view is None or not same_view(view, self._view):
            self._view, self._drawn = view, [0, 0]
            self.sizes.append(view.width)

    def edit(self) -> None:
        self._drawn[0] = 0

    def step(self, *, announce: bool = False) -> bool:
        assert self._view is not None
        self.compiling = self.announces.pop(0) if announce and self.announces else ""
        if self.compiling:
            return True
        if min(self._drawn) == SAMPLES:
            return False
        self._drawn[int(np.argmin(self._drawn))] += 1
        self._clock.now += self._each * self._view.width * self._view.height
        return True

    @property
    def shown_stride(self) -> int:
        return int(min(self._drawn) > 0)

    def draw_combined(self) -> Any:
        assert self._view is not None
        return (self._view.width, tuple(self._drawn), self._view.origin[0])


def _view(x: float = 0.0) -> View:
    return perspective_view(looking_at((x, -4.0, 1.0), (0.0, 0.0, 0.0)), 640, 480, 1.0)


def _still(picture: ProgressivePicture, session: Slow, view: View, budget: float) -> int:
    """Draw until it is finished; how often."""
    for count in range(1, 1000):
        if not picture.refine(session, view, budget):
            return count
    raise AssertionError("it never ends")


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_a_still_view_has_all_its_pixels_from_the_first_on(clock: Clock) -> None:
    session, picture = Slow(clock, 0.02, 640 * 480), ProgressivePicture(clock)
    _still(picture, session, _view(), BUDGET_S)
    assert session.sizes == [640]
    assert picture.texture == (640, (SAMPLES, SAMPLES), 0.0)
    # Two lights for the first picture, and so many for the last.
    assert picture.times.full == picture.times.first
    assert picture.times.last == pytest.approx(2 * SAMPLES * 0.02)


def test_a_moving_view_keeps_to_the_budget_and_then_gets_full_and_finished(clock: Clock) -> None:
    session, picture = Slow(clock, 0.2, 640 * 480), ProgressivePicture(clock)
    _still(picture, session, _view(), BUDGET_S)
    spent = []
    for number in range(12):
        before = clock.now
        assert picture.refine(session, _view(0.01 * (number + 1)), BUDGET_S)
        spent.append(clock.now - before)
        assert picture.is_moving
    # After two pictures it knows what it can draw; each shows both lights at the present view.
    assert max(spent[2:]) <= BUDGET_S
    width, drawn, x = picture.texture  # type: ignore[misc]
    assert width < 640
    assert min(drawn) > 0
    assert x == pytest.approx(0.12)
    small = width
    # The view stands still: at first it stays small, for a wheel may turn on.
    assert picture.refine(session, _view(0.12), BUDGET_S)
    assert picture.divisor > 1
    clock.now += SETTLE_S
    shown = []
    while picture.refine(session, _view(0.12), BUDGET_S):
        shown.append(picture.texture[0])  # type: ignore[index]
        assert not picture.is_moving
    # The small picture stays until a finer one is whole.
    assert set(shown) <= {small, 320, 640}
    assert shown == sorted(shown)
    assert picture.texture == (640, (SAMPLES, SAMPLES), pytest.approx(0.12))
    times = picture.times
    assert times.first is not None
    assert times.full is not None
    assert times.last is not None
    assert times.first <= BUDGET_S
    assert times.divisor == 640 // small
    assert times.first < times.full < times.last


def test_a_slow_view_comes_in_steps_each_finer_than_the_one_before(clock: Clock) -> None:
    session, picture = Slow(clock, 0.8, 640 * 480), ProgressivePicture(clock)
    _still(picture, session, _view(), BUDGET_S)
    for number in range(12):
        picture.refine(session, _view(0.1 * number), BUDGET_S)
    clock.now += SETTLE_S
    session.sizes.clear()
    longest, shown, unfinished = 0.0, [], True
    while unfinished:
        before = clock.now
        unfinished = picture.refine(session, _view(1.1), BUDGET_S)
        longest = max(longest, clock.now - before)
        shown.append(picture.texture[0])  # type: ignore[index]
    assert session.sizes == [160, 320, 640]
    assert [n for n, last in zip(shown, [0, *shown], strict=False) if n != last][-3:] == [
        160, 320, 640
    ]  # fmt: skip
    # Never more than what was begun when the time was up: one sample of the full picture.
    assert longest <= BUSY_S + 0.8


def test_a_move_interrupts_the_full_picture_after_one_sample(clock: Clock) -> None:
    session, picture = Slow(clock, 0.1, 640 * 480), ProgressivePicture(clock)
    _still(picture, session, _view(), BUDGET_S)
    before = clock.now
    picture.refine(session, _view(0.5), BUDGET_S)
    clock.now += SETTLE_S
    started = clock.now
    picture.refine(session, _view(0.5), BUDGET_S)
    # One sample was under way when the time was up, and nothing after it.
    assert clock.now - started <= BUSY_S + 0.1
    picture.refine(session, _view(0.6), BUDGET_S)
    assert picture.is_moving
    assert picture.texture[2] == pytest.approx(0.6)  # type: ignore[index]
    assert clock.now > before


def test_full_resolution_shows_every_pixel_at_once(clock: Clock) -> None:
    session, picture = Slow(clock, 0.3, 640 * 480), ProgressivePicture(clock)
    for number in range(5):
        picture.refine(session, _view(0.01 * number), 0.0)
        assert not picture.is_moving
    assert set(session.sizes) == {640}


def test_what_is_too_slow_for_any_size_is_shown_in_parts(clock: Clock) -> None:
    session, picture = Slow(clock, 64.0, 640 * 480), ProgressivePicture(clock)
    picture.refine(session, _view(), BUDGET_S)
    for number in range(1, 6):
        picture.refine(session, _view(0.1 * number), BUDGET_S)
        assert picture.texture[2] == pytest.approx(0.1 * number)  # type: ignore[index]
    # 64 s / 64 for a light: after one of the two its time is up.
    assert picture.texture[1] == (1, 0)  # type: ignore[index]


def test_an_edit_keeps_the_picture_until_its_light_is_there(clock: Clock) -> None:
    session, picture = Slow(clock, 0.2, 640 * 480), ProgressivePicture(clock)
    _still(picture, session, _view(), BUDGET_S)
    clock.now += 5.0
    picture.note_change()
    session.edit()
    assert picture.refine(session, _view(), BUDGET_S)
    assert picture.texture == (640, (1, SAMPLES), 0.0)
    assert picture.times.first == pytest.approx(0.2)
    _still(picture, session, _view(), BUDGET_S)
    assert picture.times.last == pytest.approx(SAMPLES * 0.2)


def test_time_for_a_shader_is_not_held_against_the_size(clock: Clock) -> None:
    session, picture = Slow(clock, 0.02, 640 * 480), ProgressivePicture(clock)
    _still(picture, session, _view(), BUDGET_S)
    session.announces = ["light"]
    picture.refine(session, _view(0.1), BUDGET_S)
    clock.now += 3.0
    picture.refine(session, _view(0.1), BUDGET_S)
    for number in range(5):
        picture.refine(session, _view(0.2 + 0.1 * number), 0.05)
        assert picture.divisor == 1


def test_another_size_of_the_viewport_is_another_view() -> None:
    view = _view()
    assert same_view(view, replace(view))
    assert not same_view(view, replace(view, width=641))
    assert not same_view(view, _view(1e-9))
    assert same_view(view, replace(view, name="another"))
    assert not same_view(view, replace(view, lens=Lens(2.0, 0.01)))


def test_times_are_told_as_far_as_they_are_known() -> None:
    assert PictureTimes().lines() == []
    times = PictureTimes(first=0.0142, divisor=4, full=0.31)
    expected = [("First (1/4 resolution)", "14 ms"), ("Full resolution", "310 ms")]
    assert times.lines() == expected
    times.last = 2.34
    assert times.lines()[2] == ("Last", "2.3 s")
