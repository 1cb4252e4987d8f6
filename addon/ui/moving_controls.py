# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of a light's controls are animated, and those controls with something in their place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from typing import Any

from ..scene.animation_reader import animation_curves
from ..scene.light_controls import LightControls

# Of the light's `bpy.types.Light`: a property's path, and its index in an array.
Moving = frozenset[tuple[str, int]]

# What is drawn into a slide's picture, and does not move in it.
_IN_PICTURE = {"relume.slide.density", "relume.slide.blur"}
_FOLLOWED = ("barn_doors", "distance", "falloff", "slide", "noise")


def moving_controls(data: Any) -> Moving:
    """The controls of a `bpy.types.Light` that are animated."""
    return frozenset(
        (curve.data_path, curve.array_index)
        for curve in animation_curves(data)
        if curve.data_path.startswith("relume.")
    )


def with_moving(
    controls: LightControls, moving: Moving, put: Callable[[str, int], Any]
) -> tuple[LightControls, Moving]:
    """Controls with something else in place of those numbers that move, and what else moves.

    Args:
        controls: of the light.
        moving: its animated properties.
        put: gives what is put in place of a property.
    """
    followed: set[tuple[str, int]] = set()

    def of(path: str, index: int, value: Any) -> Any:
        if (path, index) not in moving or path in _IN_PICTURE or isinstance(value, bool):
            return value
        followed.add((path, index))
        return put(path, index)

    parts: dict[str, Any] = {
        name: _replaced(getattr(controls, name), f"relume.{name}", of) for name in _FOLLOWED
    }
    parts["blockers"] = tuple(
        _replaced(card, f"relume.blockers[{number}]", of)
        for number, card in enumerate(controls.blockers)
    )
    return replace(controls, **parts), moving - followed


def _replaced(part: Any, path: str, of: Callable[[str, int, Any], Any]) -> Any:
    if part is None:
        return None
    new: dict[str, Any] = {}
    for field in fields(part):
        value = getattr(part, field.name)
        inner = f"{path}.{field.name}"
        if is_dataclass(value):
            # An outline's properties are its owner's in Blender.
            new[field.name] = _replaced(value, path, of)
        elif isinstance(value, float):
            new[field.name] = of(inner, 0, value)
        elif isinstance(value, tuple):
            new[field.name] = tuple(of(inner, i, number) for i, number in enumerate(value))
    return replace(part, **new)
