# SPDX-License-Identifier: GPL-3.0-or-later
"""The time left is what the pictures that are done foretell, and says no more than it knows."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from addon.time_left import seconds_left, time_left

SMALL, LARGE = 128**2, 1024**2


def cost(texels: int, own: float = 0.2, each: float = 1e-6) -> tuple[int, float]:
    return texels, own + each * texels


def test_nothing_is_said_before_anything_is_done() -> None:
    assert seconds_left([], [SMALL]) is None
    assert time_left([], [SMALL]) == ""


def test_nothing_is_left() -> None:
    assert seconds_left([cost(SMALL)], []) == 0.0
    assert time_left([cost(SMALL)], []) == ""


def test_cameras_of_several_sizes_tell_their_own_time_from_that_of_texels() -> None:
    done = [(LARGE, 60.0), cost(LARGE), cost(SMALL), cost(LARGE)]
    wanted = sum(cost(texels)[1] for texels in (SMALL, SMALL, LARGE))
    # Sums of a few numbers of one size: rounding alone is left.
    assert seconds_left(done, [SMALL, SMALL, LARGE]) == pytest.approx(wanted, rel=1e-9)


def test_cameras_of_one_size_are_as_slow_as_each_other() -> None:
    done = [(LARGE, 60.0), (LARGE, 2.0), (LARGE, 4.0)]
    assert seconds_left(done, [LARGE] * 5) == pytest.approx(15.0)


def test_the_first_camera_bears_what_is_prepared_once() -> None:
    after_two = seconds_left([(LARGE, 60.0), (LARGE, 2.0)], [LARGE] * 10)
    assert after_two == pytest.approx(20.0)
    # By itself it is a bound, and is said to be one.
    assert time_left([(LARGE, 60.0)], [LARGE]) == ", less than 1 min left"


@given(
    done=st.lists(st.tuples(st.integers(1, 4096**2), st.floats(0.001, 1000.0)), min_size=1),
    texels=st.lists(st.integers(1, 4096**2), min_size=1),
)
def test_no_measurement_leads_to_nonsense(done: list, texels: list) -> None:
    left = seconds_left(done, texels)
    assert left is not None
    # No slower than if each texel and each picture were as slow as the slowest.
    slowest = max(seconds / count for count, seconds in done)
    longest = max(seconds for _, seconds in done)
    assert 0.0 <= left <= (slowest * sum(texels) + longest * len(texels)) * (1.0 + 1e-9)
    assert seconds_left(done, [*texels, texels[0]]) >= left  # type: ignore[operator]
    assert time_left(done, texels).endswith(" left")


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.0, "a few seconds"),
        (4.9, "a few seconds"),
        (6.0, "about 10 s"),
        (30.0, "about 30 s"),
        (31.0, "about 40 s"),
        (50.0, "about 50 s"),
        (51.0, "about 1 min"),
        (61.0, "about 2 min"),
        (3540.0, "about 59 min"),
        (3600.0, "about 1 h"),
        (3601.0, "about 1 h 1 min"),
        (7200.0, "about 2 h"),
    ],
)
def test_words(seconds: float, words: str) -> None:
    assert time_left([(1, 99.0), (1, seconds)], [1]) == f", {words} left"
