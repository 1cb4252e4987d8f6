# SPDX-License-Identifier: GPL-3.0-or-later
"""The material table with rows behind it that say what is edited about each material."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import Texture, read_texture, texture_from_array
from ..scene.surface_edit import NO_EDIT, SurfaceEdit, SurfaceEdits
from .surface_layout import EDIT_ROWS, SurfaceLayout


class SurfaceEditTable:
    """Makes material tables that hold edits.

    Args:
        layout: of the surfaces, without edits.
        material_table: of the cache, without edits; see `MaterialTable`.
    """

    def __init__(self, layout: SurfaceLayout, material_table: Texture) -> None:
        self._layout = layout
        self._rows = read_texture(material_table)

    @property
    def edit_row(self) -> int:
        """The first row of edits."""
        return int(self._rows.shape[0])

    def mean(self, material: int, channel: str) -> NDArray[np.float64] | None:
        """(components,) the mean of a stored channel over a material of the plan."""
        places = [i for i, (name, _) in enumerate(self._layout.values) if name == channel]
        if not places:
            return None
        column = self._rows[:, 1 + material].reshape(-1)
        return column[places].astype(np.float64)

    def texture(self, edits: SurfaceEdits) -> Texture:
        """RGBA32F: the cache's rows, and those that `read_edit` in surface_edit.glsl reads.

        A material that the cache does not know is not edited: nothing of it is cached.
        """
        rows = np.repeat(_texels(NO_EDIT)[:, None], self._rows.shape[1], axis=1)
        for index, name in enumerate(self._layout.plan.material_names):
            edit = edits.materials.get(name)
            if edit is not None:
                rows[:, 1 + index] = _texels(edit)
        return texture_from_array(np.concatenate([self._rows, rows]), "RGBA32F")


def _texels(edit: SurfaceEdit) -> NDArray[np.float32]:
    """(EDIT_ROWS, 4) of one edit."""
    texels = np.zeros((EDIT_ROWS, 4), dtype=np.float32)
    texels[0, :3] = edit.color_factor
    texels[1, :3] = edit.specular_factor
    texels[2, :3] = edit.roughness, edit.roughness_offset, edit.emission
    return texels
