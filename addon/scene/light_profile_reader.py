# SPDX-License-Identifier: GPL-3.0-or-later
"""Has Cycles evaluate lights' nodes: a picture of what they emit in every direction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from .depsgraph_reader import with_render_depsgraph
from .light import Light
from .light_nodes_reader import (
    MeasuredNodes,
    UnmeasuredLight,
    constant_emission,
    framing,
    is_fine,
    known,
    of_direction,
    of_distance,
    of_extent,
    of_world,
    remember,
)
from .light_profile import LightProfile
from .light_reader import unmeasured_lights
from .light_stage_reader import LightStage, light_stage
from .node_use import nodes_within

# Texels along the shorter side of pictures of textures: all around 0.35 degrees each.
FINE_HEIGHT = 512
# And of anything else. IES files tell an angle in some degrees.
HEIGHT = 256
# Of pictures that only tell how emission depends on the distance, or whether on the place.
_SMALL = 16
# Differences below are none: float32 through some nodes.
_SAME = 1e-5
# What a fitted falloff may be off before it is called another.
_FITTED = 5e-3
# Cosine between an area light's sides that cannot be told from a right angle.
_SHEARED = 1e-4


def measure_lights(scene: Any, lights: Sequence[UnmeasuredLight]) -> None:
    """Measure what is not known yet, at the scene's frame, and remember it.

    It renders, and so must not be called while something else does.

    Raises:
        InputError: there is no room for the pictures.
    """
    for each in lights:
        if known(each.key) is None:
            remember(each.key, each.light.name, _measure(scene, each.data, each.light))


def ensure_measured(scene: Any) -> None:
    """Measure whatever `read_lights` would lack in a render of a scene at its current frame.

    Only for background use, and not from within a render: it runs some itself.

    Raises:
        InputError: there is no room for the pictures.
    """
    if any(constant_emission(data) is None for data in bpy.data.lights):
        measure_lights(scene, with_render_depsgraph(scene, unmeasured_lights))


def _measure(scene: Any, data: Any, light: Light) -> MeasuredNodes:
    nodes = list(nodes_within(data.node_tree))
    half_width, exponent, smooth = framing(light), 0.0, 0.0
    problems = _untold(light, nodes)
    over_area = None
    with light_stage(scene, data, light, nodes) as stage:
        if light.type == "SUN":
            picture = stage.emission(_SMALL, 0.0, 1.0)
            return MeasuredNodes(np.asarray(picture.reshape(-1, 3).max(axis=0)))
        if of_distance(nodes):
            fitted = _fit_distance(stage, half_width)
            if fitted is None:
                problems.append(
                    "its nodes depend on the distance in a way that is not modelled; what they "
                    "give at one metre is used"
                )
            else:
                exponent, smooth = fitted
        if light.type == "AREA" and of_extent(nodes):
            over_area = stage.area(light, of_world(nodes)).astype(np.float32)
            picture = np.ones((1, 1, 3))
        else:
            height = FINE_HEIGHT if is_fine(nodes) else HEIGHT
            picture = stage.emission(height, half_width, 1.0)
    color = picture.reshape(-1, 3).max(axis=0)
    is_even = (color - picture.reshape(-1, 3).min(axis=0) <= _SAME * color.max()).all()
    if is_even and over_area is None and exponent == smooth == 0.0:
        return MeasuredNodes(color, None, tuple(problems))
    profile = LightProfile(picture.astype(np.float32), half_width, exponent, smooth, over_area)
    return MeasuredNodes(np.ones(3), profile, tuple(problems))


def _untold(light: Light, nodes: list[Any]) -> list[str]:
    """A phrase for each thing about a light's nodes that no table tells."""
    problems = []
    if light.has_disk and not light.use_soft_falloff:
        problems.append("its nodes are shaded as those of a light with soft falloff")
    if light.type != "AREA" or not of_extent(nodes):
        return problems
    if of_direction(nodes):
        problems.append(
            "its nodes vary over its area and with the direction at once; what they show straight "
            "ahead is used"
        )
    sides = np.linalg.norm(light.extents, axis=1)
    if abs(light.extents[0] @ light.extents[1]) > _SHEARED * sides.prod():
        problems.append("it is sheared, and its nodes are shown as if it were not")
    return problems


def _fit_distance(stage: LightStage, half_width: float) -> tuple[float, float] | None:
    """The exponent and smoothness of a LightProfile; None if they don't tell it."""
    radii = np.array([0.25, 1.0, 4.0, 16.0])
    pictures = np.stack([stage.emission(_SMALL, half_width, r) for r in radii])
    brightest = pictures[1] > 0.5 * pictures[1].max()
    gains = np.array([picture[brightest].mean() for picture in pictures])
    if not gains[1] > 0.0:
        return 0.0, 0.0
    gains /= gains[1]
    for exponent in (0.0, 1.0, 2.0):
        # g(r) = r^e (1 + s) r^2 / (s + r^2), solved for s at the first radius.
        ratio, r = gains[0] / radii[0] ** exponent, radii[0]
        smooth = r * r * (1.0 - ratio) / max(ratio - r * r, 1e-30) if ratio < 1.0 - _FITTED else 0.0
        if smooth < 0.0:
            continue
        wanted = radii**exponent * (1.0 + smooth) * radii**2 / (smooth + radii**2)
        shown = pictures / wanted[:, None, None, None]
        if np.abs(shown - shown[1]).max() <= _FITTED * shown[1].max():
            return exponent, float(smooth)
    return None
