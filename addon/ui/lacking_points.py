# SPDX-License-Identifier: GPL-3.0-or-later
"""Caching cameras for what a cache lacks of a view, as the artist wants it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..camplace.camera import CachingCamera
from ..camplace.hole_cameras import hole_cameras
from ..scene.view import View

if TYPE_CHECKING:
    from ..relight.session import RelightSession

# So large a share of a view has to be open: a row of pixels is none.
LEAST_OPEN = 5e-4
# And of what it sees to be soft: edges of near things always are.
LEAST_SOFT = 1e-2


def lacking_cameras(scene: Any, session: RelightSession, view: View) -> tuple[CachingCamera, ...]:
    """Cameras that see the holes of a view, and what is soft where that is to be sharp; neither
    where there is too little of it to be seen.

    Args:
        scene: a `bpy.types.Scene`.
        session: at this very view.
        view: that is looked at.
    """
    sharpens = scene.relume.sharpen_views
    is_open = session.coverage.open_fraction >= LEAST_OPEN
    if not (is_open or sharpens):
        return ()
    points = session.hole_points(and_soft=sharpens)
    if points.soft_fraction < LEAST_SOFT:
        if not is_open:
            return ()
        # Edges alone would have all holes baked four times as finely.
        points = replace(points, is_soft=None)
    return hole_cameras(view, points)
