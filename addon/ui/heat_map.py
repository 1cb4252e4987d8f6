# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport's heat map: how far each pixel of its picture may be trusted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gpu
from gpu_extras.presets import draw_texture_2d

from ..scene.view import View, same_view

if TYPE_CHECKING:
    from ..glsl.shader import Texture
    from ..relight.session import RelightSession


class HeatMap:
    """Of the view that was asked for last; made anew only when that is another."""

    def __init__(self) -> None:
        self._view: View | None = None
        self._texture: Texture | None = None

    def forget(self) -> None:
        """Something else than the view changed."""
        self._view = self._texture = None

    def update(self, session: RelightSession, view: View) -> None:
        """Make it for the session's view, if it is not there."""
        if self._view is None or not same_view(view, self._view):
            # Imported late: it takes scipy along, which would slow down every start of Blender.
            from ..corrmap.confidence import draw_heat_map

            self._texture = draw_heat_map(session.confidence())
            self._view = view

    def draw(self, view: View) -> None:
        """Lay it over the whole viewport; not while the view is another than it was made for."""
        if self._texture is None or self._view is None or not same_view(view, self._view):
            return
        gpu.state.blend_set("ALPHA_PREMULT")
        draw_texture_2d(self._texture, (0, 0), view.width, view.height)
        gpu.state.blend_set("NONE")
