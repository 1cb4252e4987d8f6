# SPDX-License-Identifier: GPL-3.0-or-later
"""What animates a data-block."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def animation_curves(block: Any) -> Iterator[Any]:
    """The F-curves and drivers that animate a `bpy.types.ID`."""
    animation = block.animation_data
    if animation is None:
        return
    yield from animation.drivers
    if animation.action is None or animation.action_slot is None:
        return
    for layer in animation.action.layers:
        for strip in layer.strips:
            bag = strip.channelbag(animation.action_slot)
            if bag is not None:
                yield from bag.fcurves
