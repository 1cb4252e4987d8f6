# SPDX-License-Identifier: GPL-3.0-or-later
"""The shot's views from a little elsewhere: where an artist may move them to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..scene.view import View
from .rays import RayCaster
from .samples import Samples

# How far a view may move, as a share of its viewing distance.
MOVED = 0.1


def moved_view(view: View, seen: Samples, rays: RayCaster, rng: np.random.Generator) -> View:
    """The view from up to `MOVED` of its viewing distance away, on the same side of all walls.

    The offset is even over a ball. A way that a surface blocks is halved until it is free. The
    viewing distance is the median of that to the samples `seen`, of which there is at least one.
    """
    distance = float(np.median(np.linalg.norm(seen.point - view.origin, axis=-1)))
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    offset = direction * (MOVED * distance * np.cbrt(rng.random()))
    while rays.occluded(view.origin[None], (view.origin + offset)[None]).any():
        offset = 0.5 * offset
    world_from_camera = view.world_from_camera.copy()
    world_from_camera[:3, 3] = view.origin + offset
    return replace(view, world_from_camera=world_from_camera)
