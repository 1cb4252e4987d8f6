# SPDX-License-Identifier: GPL-3.0-or-later
"""Equality of descriptions that hold arrays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.scene.light import Light
from addon.scene.light_controls import Blocker, LightControls, Slide, Superellipse
from addon.scene.same import is_same

SLIDE = Slide(np.ones((2, 2, 4), dtype=np.float32), "Leaves")
LIGHT = Light("Key", "SPOT", np.eye(4), 5.0, np.ones(3), controls=LightControls(slide=SLIDE))


def test_equal_copies_are_the_same() -> None:
    copy = replace(
        LIGHT,
        world_from_light=np.eye(4),
        controls=LightControls(slide=replace(SLIDE, pixels=SLIDE.pixels.copy())),
    )
    assert is_same(LIGHT, copy)


CARD = Blocker("Card", np.eye(4), Superellipse(1.0, 1.0))
OTHERS = {
    "a number": replace(LIGHT, energy=6.0),
    "an array": replace(LIGHT, world_from_light=2.0 * np.eye(4)),
    "a shape": replace(LIGHT, world_from_light=np.eye(3)),
    "an array deep inside": replace(
        LIGHT, controls=LightControls(slide=replace(SLIDE, pixels=0.5 * SLIDE.pixels))
    ),
    "one more": replace(LIGHT, controls=LightControls(slide=SLIDE, blockers=(CARD,))),
    "nothing": None,
}


@pytest.mark.parametrize("what", OTHERS)
def test_every_difference_counts(what: str) -> None:
    assert not is_same(LIGHT, OTHERS[what])
    assert not is_same(OTHERS[what], LIGHT)
