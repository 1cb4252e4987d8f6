# SPDX-License-Identifier: GPL-3.0-or-later
"""The size of a moving view's pictures: within the budget, and steady."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from addon.corrmap.move_budget import DIVISORS, MEMORY, MoveBudget, smaller
from tests.synthetic import looking_at, perspective_view

PIXELS = 640 * 480


def _run(budget: MoveBudget, seconds: float, fixed: float, each: float, count: int) -> list[int]:
    """The divisors of so many pictures, each of which takes `fixed` and `each` for its pixels."""
    chosen = []
    for _ in range(count):
        divisor = budget.choose(seconds, PIXELS)
        budget.took(divisor, fixed + each * PIXELS / divisor**2)
        chosen.append(divisor)
    return chosen


def test_a_cheap_view_keeps_all_its_pixels() -> None:
    assert set(_run(MoveBudget(), 0.016, 0.001, 0.010 / PIXELS, 50)) == {1}


@pytest.mark.parametrize("seconds", [0.016, 0.033, 0.050])
@pytest.mark.parametrize("whole", [0.02, 0.06, 0.2, 0.8])
def test_after_two_pictures_all_are_within_the_budget(seconds: float, whole: float) -> None:
    chosen = _run(MoveBudget(), seconds, 0.0, whole / PIXELS, 60)
    assert all(whole / divisor**2 <= seconds for divisor in chosen[2:])
    # And no smaller than they need be: the next finer size would take more than there is room.
    finest = min(d for d in DIVISORS if whole / d**2 <= seconds)
    assert DIVISORS.index(chosen[-1]) - DIVISORS.index(finest) <= 1


@given(
    st.floats(0.001, 2.0),
    st.floats(0.0, 0.02),
    st.sampled_from([0.016, 0.033, 0.050]),
)
def test_the_size_settles(whole: float, fixed: float, seconds: float) -> None:
    chosen = _run(MoveBudget(), seconds, fixed, whole / PIXELS, 100)
    # Steps down and up until both sides are known; then one size until something is forgotten.
    assert len(set(chosen[40:])) == 1


def test_noise_within_a_quarter_does_not_change_the_size() -> None:
    budget, random = MoveBudget(), np.random.default_rng(0)
    chosen = []
    for _ in range(300):
        divisor = budget.choose(0.033, PIXELS)
        budget.took(divisor, 0.110 / divisor**2 * random.uniform(0.9, 1.1))
        chosen.append(divisor)
    assert set(chosen[5:]) == {2}


def test_what_no_size_can_do_is_drawn_at_the_smallest() -> None:
    assert _run(MoveBudget(), 0.016, 0.1, 1.0 / PIXELS, 20)[-1] == DIVISORS[-1]


def test_it_comes_back_when_the_scene_gets_cheaper() -> None:
    budget = MoveBudget()
    assert _run(budget, 0.033, 0.0, 0.8 / PIXELS, 20)[-1] > 4
    cheaper = _run(budget, 0.033, 0.0, 0.01 / PIXELS, MEMORY + 40)
    # At once nearly, and wholly when it has forgotten what the full size took before.
    assert cheaper[40] <= 2
    assert cheaper[-1] == 1


def test_a_hiccup_is_forgotten() -> None:
    budget = MoveBudget()
    _run(budget, 0.033, 0.0, 0.02 / PIXELS, 10)
    budget.took(1, 2.0)
    chosen = _run(budget, 0.033, 0.0, 0.02 / PIXELS, MEMORY + 40)
    assert chosen[0] > 1
    assert chosen[-1] == 1


def test_a_larger_view_is_drawn_smaller_at_once() -> None:
    budget = MoveBudget()
    assert _run(budget, 0.033, 0.0, 0.03 / PIXELS, 10)[-1] == 1
    assert budget.choose(0.033, 9 * PIXELS) == 3


def test_without_a_budget_every_pixel_is_drawn() -> None:
    budget = MoveBudget()
    _run(budget, 0.016, 0.0, 1.0 / PIXELS, 10)
    assert budget.choose(0.0, PIXELS) == 1


@pytest.mark.parametrize("divisor", DIVISORS)
@pytest.mark.parametrize("size", [(640, 480), (641, 7), (1, 1)])
def test_a_smaller_view_sees_the_same(divisor: int, size: tuple[int, int]) -> None:
    view = perspective_view(looking_at((1.0, 2.0, 3.0), (0.0, 0.0, 0.0)), *size, 1.0)
    small = smaller(view, divisor)
    assert small.width * divisor >= view.width
    share = np.array([[0.0, 0.0], [0.25, 0.8], [1.0, 1.0]])
    for at in share:
        whole = view.rays(at * [view.width, view.height])[1]
        part = small.rays(at * [small.width, small.height])[1]
        # The same matrices, and a share of the picture to float64's rounding.
        np.testing.assert_allclose(part, whole, rtol=0.0, atol=1e-14)
