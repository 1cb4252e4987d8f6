# SPDX-License-Identifier: GPL-3.0-or-later
"""The material table with rows behind it that say what is edited about each material."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import Texture, read_texture, texture_from_array
from ..scene.surface_edit import NO_EDIT, SurfaceEdit, SurfaceEdits
from .surface_layout import EDIT_ROWS


class SurfaceEditTable:
    """Makes material tables that hold edits.

    Args:
        materials: `ChannelPlan.material_names`.
        material_table: of the cache, without edits; see `MaterialTable`.
    """

    def __init__(self, materials: Sequence[str], material_table: Texture) -> None:
        self._materials = tuple(materials)
        self._rows = read_texture(material_table)

    @property
    def edit_row(self) -> int:
        """The first row of edits."""
        return int(self._rows.shape[0])

    @property
    def means(self) -> NDArray[np.float32]:
        """(rows, columns, 4): the cache's own rows."""
        return self._rows

    def texture(self, edits: SurfaceEdits) -> Texture:
        """RGBA32F: the cache's rows, and those that `read_edit` in surface_edit.glsl reads.

        A material that the cache does not know is not edited: nothing of it is cached.
        """
        rows = np.repeat(_texels(NO_EDIT)[:, None], self._rows.shape[1], axis=1)
        for index, name in enumerate(self._materials):
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
