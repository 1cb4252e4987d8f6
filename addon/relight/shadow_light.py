# SPDX-License-Identifier: GPL-3.0-or-later
"""A light as its shadows see it: moved, softer or harder than it shines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..scene.frame_across import frame_across
from ..scene.light import Light
from ..scene.light_controls import NEUTRAL


def shadow_light(light: Light, *, everywhere: bool = False) -> Light:
    """The light whose points shadows are looked up for; the light itself where nothing is cheated.

    Its samples are those of `light_sample`, by the same numbers as the light's own, so that a
    penumbra and the highlight beside it are made of points that belong together. It has no
    filters, and where it is moved no cone: what the light shows lies in other directions there.

    Args:
        light: the light.
        everywhere: whether a softer or harder one has no cone either.
    """
    shadow = light.controls.shadow
    offset = np.array(shadow.offset, dtype=np.float64)
    if shadow.softness == 1.0 and not offset.any():
        return light
    extent = shadow.softness
    world_from_light = light.world_from_light.copy()
    if light.type == "SUN":
        toward = offset - light.direction
        length = float(np.linalg.norm(toward))
        if offset.any() and length > 0.0:
            world_from_light[:3, 2] = toward / length
            world_from_light[:3, :2] = frame_across(toward / length).T
    else:
        world_from_light[:3, 3] += offset
    if everywhere or offset.any():
        light = replace(light, spot_size=2.0 * np.pi, spot_blend=0.0, spread=float(np.pi))
    return replace(
        light,
        world_from_light=world_from_light,
        shadow_soft_size=light.shadow_soft_size * extent,
        angle=min(light.angle * extent, float(np.pi)),
        size=light.size * extent,
        size_y=light.size_y * extent,
        controls=replace(NEUTRAL, shadow=shadow),
    )
