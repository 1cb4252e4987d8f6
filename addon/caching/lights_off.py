# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights that send out nothing, while surfaces are rendered that only a white sky lights.

Their light is left out of the sky's anyway; but for each leaf that a ray passes on its way Cycles
would choose a light, and look through all leaves whether it arrives.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from ..stopping import uninterrupted


@contextmanager
def lights_off() -> Iterator[None]:
    """Dark copies of all lights in their place while the block runs.

    All of their settings are the lights' own, which drivers may read: only what they shine is gone.
    """
    swapped: list[tuple[Any, Any]] = []
    try:
        for light in tuple(bpy.data.lights):
            dark = light.copy()
            swapped.append((light, dark))
            dark.use_fake_user = False
            # A shader without a surface: Cycles leaves the light out.
            dark.use_nodes = True
            dark.node_tree.nodes.clear()
            light.user_remap(dark)
        yield
    finally:
        with uninterrupted():
            for light, dark in swapped:
                dark.user_remap(light)
            bpy.data.batch_remove([dark for _, dark in swapped])
