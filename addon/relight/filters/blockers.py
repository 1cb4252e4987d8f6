# SPDX-License-Identifier: GPL-3.0-or-later
"""Cards in a light's beam: addon/glsl/lib/blockers_filter.glsl."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...glsl.uniforms import Field
from ...scene.light import Light
from ...scene.light_controls import MOST_BLOCKERS, Blocker
from .light_filter import LightFilter
from .outline import outline_sizes

_FIELDS = (
    Field("vec4", "blockers_x", MOST_BLOCKERS),
    Field("vec4", "blockers_y", MOST_BLOCKERS),
    Field("vec4", "blockers_z", MOST_BLOCKERS),
    Field("vec4", "blockers_outline", MOST_BLOCKERS),
    Field("vec4", "blockers_shape", MOST_BLOCKERS),
    Field("vec4", "blockers_taken", MOST_BLOCKERS),
    Field("float", "blockers_count"),
)

# Radians. A card that a sun sees under less is edge-on, and takes nothing.
_EDGE_ON = 1e-9


def blockers_filter(light: Light) -> LightFilter | None:
    """The light's blockers; None if none of them takes anything.

    Raises:
        ValueError: there are more than MOST_BLOCKERS; the reader leaves those out.
    """
    placed = [
        (blocker, rows)
        for blocker in light.controls.blockers
        if blocker.density > 0.0 and (rows := blocker_from_light(light, blocker)) is not None
    ]
    if not placed:
        return None
    if len(placed) > MOST_BLOCKERS:
        raise ValueError(f"light '{light.name}' has more than {MOST_BLOCKERS} blockers")
    rows = np.stack([rows for _, rows in placed])
    cards = [blocker for blocker, _ in placed]
    values = {
        "blockers_x": rows[:, 0],
        "blockers_y": rows[:, 1],
        "blockers_z": rows[:, 2],
        "blockers_outline": np.array([outline_sizes(card.outline) for card in cards]),
        "blockers_shape": np.array(
            [(card.outline.roundness, float(card.invert), 0.0, 0.0) for card in cards]
        ),
        "blockers_taken": np.array(
            [(*(card.density * (1.0 - np.array(card.color))), 0.0) for card in cards]
        ),
        "blockers_count": float(len(cards)),
    }
    return LightFilter("blockers", _FIELDS, values, library=("beam", "superellipse"))


def blocker_from_light(light: Light, blocker: Blocker) -> NDArray[np.float64] | None:
    """(3, 4) float64: from light space to the card's own x and y, in its object's units, and the
    height over its plane in metres; None for a card that is scaled to nothing.

    Only the object's X and Y count: one that is flat along Z still is a card.
    """
    x, y = blocker.world_from_blocker[:3, 0], blocker.world_from_blocker[:3, 1]
    normal = np.cross(x, y)
    area = float(np.linalg.norm(normal))
    if not area > 0.0:
        return None
    normal = normal / area
    world_from_card = np.stack([x, y, normal], axis=1)
    card_from_world = np.linalg.inv(world_from_card)
    rows = np.empty((3, 4))
    rows[:, :3] = card_from_world @ light.axes.T
    rows[:, 3] = card_from_world @ (light.position - blocker.world_from_blocker[:3, 3])
    if light.type == "SUN" and abs(rows[2, 2]) < _EDGE_ON:
        return None
    return rows
