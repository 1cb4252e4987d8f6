# SPDX-License-Identifier: GPL-3.0-or-later
"""What a cache lacks of a view, as the artist wants it baked."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..camplace.hole_cameras import HolePoints
    from ..relight.session import RelightSession

# So large a share of a view has to be open: a row of pixels is none.
LEAST_OPEN = 5e-4
# And of what it sees to be soft: edges of near things always are.
LEAST_SOFT = 1e-2


def lacking_points(scene: Any, session: RelightSession) -> HolePoints | None:
    """The holes of a session's view, and what is soft where that is to be sharp; None where there
    is too little of it to be seen.

    Args:
        scene: a `bpy.types.Scene`.
        session: at the view.
    """
    sharpens = scene.relume.sharpen_views
    is_open = session.coverage.open_fraction >= LEAST_OPEN
    if not (is_open or sharpens):
        return None
    points = session.hole_points(and_soft=sharpens)
    if points.soft_fraction < LEAST_SOFT:
        if not is_open:
            return None
        # Edges alone would have all holes baked four times as finely.
        return replace(points, is_soft=None)
    return points


def label(points: HolePoints) -> str:
    """What having them baked is called."""
    return "Filling holes" if points.is_soft is None else "Sharpening the view"
