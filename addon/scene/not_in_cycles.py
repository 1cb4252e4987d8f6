# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a light's controls Cycles cannot show."""

from __future__ import annotations

from .light import LightType
from .light_controls import LightControls, ShadowControls


def not_in_cycles(kind: LightType, controls: LightControls) -> tuple[str, ...]:
    """A phrase for each control in use that a Cycles render of the light lacks.

    Args:
        kind: the light's type.
        controls: of the light.
    """
    return (
        *_of_suns(kind, controls),
        *_of_shadows(controls.shadow),
        *_of_weights(controls),
    )


def _of_suns(kind: LightType, controls: LightControls) -> tuple[str, ...]:
    # A sun's shader knows neither the place that it lights nor the distance to it.
    if kind != "SUN":
        return ()
    used = {
        "a sun's barn doors": controls.barn_doors,
        "a sun's near and far": controls.distance,
        "a sun's slide": controls.slide,
        "a sun's noise": controls.noise,
        "a sun's blockers": controls.blockers,
    }
    return tuple(name for name, control in used.items() if control)


def _of_shadows(shadow: ShadowControls) -> tuple[str, ...]:
    neutral = ShadowControls()
    used = {
        "shadow colour": any(shadow.color),
        "shadow density": shadow.density != neutral.density,
        "shadow softness": shadow.softness != neutral.softness,
        "shadow position": shadow.offset != neutral.offset,
    }
    filled = any(shadow.color) or shadow.density < 1.0
    if filled and shadow.hide_highlights:
        used["highlights hidden in shadow"] = True
    return tuple(name for name, is_used in used.items() if is_used)


def _of_weights(controls: LightControls) -> tuple[str, ...]:
    # Weights of 0 and 1 are ray visibility.
    used = {
        f"a diffuse weight of {controls.diffuse:g}": controls.diffuse not in {0.0, 1.0},
        f"a specular weight of {controls.specular:g}": controls.specular not in {0.0, 1.0},
        "an ambient weight": controls.ambient != 0.0,
    }
    return tuple(name for name, is_used in used.items() if is_used)
