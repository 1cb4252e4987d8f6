# SPDX-License-Identifier: GPL-3.0-or-later
"""What an edit of a light changes, and the colour that its layer leaves to the sum.

A layer holds the light as if its intensity were one. Energy, colour, exposure and temperature only
scale it, so an edit of these draws nothing but the sum.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...scene.light import Light
from ...scene.light_controls import NEUTRAL, ShadowControls
from ...scene.light_linking import LightLinking
from ...scene.same import is_same
from ..graph.frame_passes import Part


def layer_tint(light: Light) -> NDArray[np.float64]:
    """(3,) the light's colour inside its layer: white, or its hue where shadows are filled.

    A shadow's fill does not go with the light's hue, so the layer cannot leave that to the sum.
    """
    intensity = light.intensity
    largest = float(np.abs(intensity).max())
    if not any(light.controls.shadow.color) or largest == 0.0:
        return np.ones(3)
    return intensity / largest


def layer_scale(light: Light) -> NDArray[np.float64]:
    """(3,) what the layer is multiplied with in the sum."""
    intensity = light.intensity
    if not any(light.controls.shadow.color):
        return intensity
    return np.full(3, float(np.abs(intensity).max()))


def changed_parts(before: Light, after: Light) -> tuple[Part, ...]:
    """The parts of a light that differ: those behind come along with those before them."""
    parts: list[Part] = []
    if not is_same(_caster(before), _caster(after)):
        parts.append("shadow casting")
    if not is_same(_shape(before), _shape(after)):
        parts.append("shape")
    if not is_same(layer_scale(before), layer_scale(after)):
        parts.append("color")
    return tuple(parts)


def _shape(light: Light) -> Light:
    """The light without what only scales its layer."""
    return replace(_unmixed(light), color=layer_tint(light))


def _caster(light: Light) -> Light:
    """The light without what its shadow maps do not depend on."""
    shadow = light.controls.shadow
    kept = ShadowControls(softness=shadow.softness, offset=shadow.offset)
    return replace(
        _unmixed(light),
        spot_blend=0.0,
        spread=float(np.pi),
        diffuse_factor=1.0,
        specular_factor=1.0,
        profile=None,
        controls=replace(NEUTRAL, shadow=kept),
        linking=LightLinking(blockers=light.linking.blockers),
    )


def _unmixed(light: Light) -> Light:
    """The light without what counts when layers are summed."""
    return replace(
        light,
        energy=1.0,
        color=np.ones(3),
        exposure=0.0,
        normalize=True,
        mute=False,
        solo=False,
        warnings=(),
    )
