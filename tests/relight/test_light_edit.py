# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a light an edit changes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.relight.lights.light_edit import changed_parts, layer_scale, layer_tint
from addon.scene.light import Light
from addon.scene.light_controls import (
    BarnDoors,
    DistanceRange,
    LightControls,
    ShadowControls,
    Superellipse,
)

KEY = Light(
    "Key", "SPOT", np.eye(4), 10.0, np.array([1.0, 0.5, 0.25]), shadow_soft_size=0.1
)  # fmt: skip
FILLED = replace(KEY, controls=LightControls(shadow=ShadowControls(color=(0.1, 0.2, 0.3))))
DOORS = BarnDoors(Superellipse(0.2, 0.3))


def controls(**values: Any) -> dict[str, Any]:
    return {"controls": LightControls(**values)}


COLOR = ("color",)
SHAPE = ("shape",)
CASTS = ("shadow casting", "shape")
EDITS: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "nothing": ({}, ()),
    "warnings": ({"warnings": ("something",)}, ()),
    "mute": ({"mute": True}, ()),
    "solo": ({"solo": True}, ()),
    "energy": ({"energy": 20.0}, COLOR),
    "color": ({"color": np.ones(3)}, COLOR),
    "exposure": ({"exposure": 1.0}, COLOR),
    "normalize": ({"normalize": False}, COLOR),
    "spot_blend": ({"spot_blend": 0.9}, SHAPE),
    "specular_factor": ({"specular_factor": 0.0}, SHAPE),
    "barn doors": (controls(barn_doors=DOORS), SHAPE),
    "distance": (controls(distance=DistanceRange(near=1.0)), SHAPE),
    "shadow density": (controls(shadow=ShadowControls(density=0.5)), SHAPE),
    "shadow softness": (controls(shadow=ShadowControls(softness=2.0)), CASTS),
    "shadow offset": (controls(shadow=ShadowControls(offset=(0.1, 0.0, 0.0))), CASTS),
    "place": ({"world_from_light": 2.0 * np.eye(4)}, CASTS),
    "cone": ({"spot_size": 1.0}, CASTS),
    "radius": ({"shadow_soft_size": 0.2}, CASTS),
}


@pytest.mark.parametrize("what", EDITS)
def test_an_edit_changes_its_parts(what: str) -> None:
    attributes, parts = EDITS[what]
    assert changed_parts(KEY, replace(KEY, **attributes)) == parts


def test_a_filled_shadow_takes_the_hue_into_the_layer() -> None:
    """The fill does not go with the hue, so the layer has it; brightness still only scales."""
    assert changed_parts(FILLED, replace(FILLED, energy=20.0)) == COLOR
    redder = replace(FILLED, color=np.array([1.0, 0.1, 0.1]))
    assert changed_parts(FILLED, redder) == SHAPE
    assert changed_parts(KEY, FILLED) == ("shape", "color")


@pytest.mark.parametrize("light", [KEY, FILLED, replace(FILLED, energy=0.0)])
def test_tint_times_scale_is_the_intensity(light: Light) -> None:
    # A quotient and a product of float64 numbers.
    together = layer_tint(light) * layer_scale(light)
    assert together == pytest.approx(light.intensity, rel=4e-16)
