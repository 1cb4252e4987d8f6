# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said beforehand about controls that Cycles lacks."""

from __future__ import annotations

import pytest

from addon.scene.light_controls import (
    BarnDoors,
    DistanceRange,
    Falloff,
    LightControls,
    Noise,
    ShadowControls,
    Superellipse,
)
from addon.scene.not_in_cycles import not_in_cycles

SHAPED = LightControls(
    barn_doors=BarnDoors(Superellipse(1.0, 1.0)),
    distance=DistanceRange(near=1.0),
    falloff=Falloff(0.0),
    noise=Noise(0.5),
    diffuse=0.0,
)


def test_shaping_is_in_cycles() -> None:
    assert not_in_cycles("POINT", SHAPED) == ()


def test_suns_are_not_shaped() -> None:
    names = ("a sun's barn doors", "a sun's near and far", "a sun's noise")
    assert not_in_cycles("SUN", SHAPED) == names


@pytest.mark.parametrize(
    ("controls", "phrase"),
    [
        (LightControls(shadow=ShadowControls(color=(1.0, 0.0, 0.0))), "shadow colour"),
        (LightControls(shadow=ShadowControls(density=0.5)), "shadow density"),
        (LightControls(shadow=ShadowControls(softness=2.0)), "shadow softness"),
        (LightControls(shadow=ShadowControls(offset=(1.0, 0.0, 0.0))), "shadow position"),
        (LightControls(diffuse=0.5), "a diffuse weight of 0.5"),
        (LightControls(specular=2.0), "a specular weight of 2"),
        (LightControls(ambient=0.1), "an ambient weight"),
    ],
)
def test_cheats_are_named(controls: LightControls, phrase: str) -> None:
    assert phrase in not_in_cycles("AREA", controls)


def test_neutral_controls_lack_nothing() -> None:
    assert not_in_cycles("SUN", LightControls()) == ()
