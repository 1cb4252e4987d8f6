# SPDX-License-Identifier: GPL-3.0-or-later
"""A light as its shadows see it: moved, softer or harder than it shines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...scene.frame_across import frame_across
from ...scene.light import Light
from ...scene.light_controls import NEUTRAL


def shadow_light(light: Light) -> Light:
    """The light whose points shadows are looked up for; the light itself where nothing is cheated.

    Its samples are those of `light_sample`, by the same numbers as the light's own, so that a
    penumbra and the highlight beside it are made of points that belong together. It has no
    filters and no profile, and a spot that is moved no cone: what it lights lies in other
    directions there.
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
    return replace(
        shining_everywhere(light) if light.type == "SPOT" and offset.any() else light,
        world_from_light=world_from_light,
        shadow_soft_size=light.shadow_soft_size * extent,
        angle=min(light.angle * extent, float(np.pi)),
        size=light.size * extent,
        size_y=light.size_y * extent,
        controls=replace(NEUTRAL, shadow=shadow),
        profile=None,
    )


def shining_everywhere(light: Light) -> Light:
    """The same without a cone or a dark back, for one point of it that shadow rays go to."""
    if light.type == "SPOT":
        return replace(light, spot_size=2.0 * np.pi, spot_blend=0.0)
    if light.type == "AREA":
        return replace(light, type="POINT", shadow_soft_size=0.0)
    return light
