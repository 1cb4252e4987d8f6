# SPDX-License-Identifier: GPL-3.0-or-later
"""The material table with rows behind it that say what is edited about materials and objects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import Texture, read_texture, texture_from_array
from ..scene.surface_edit import NO_EDIT, SurfaceEdit, SurfaceEdits
from .surface_layout import EDIT_ROWS, SurfaceLayout

# Columns of the table that objects may take: textures of 1024 texels and more are everywhere.
_WIDTH = 1024


class SurfaceEditTable:
    """Makes material tables that hold edits.

    Args:
        layout: of the surfaces, without edits.
        material_table: of the cache, without edits; see `MaterialTable`.
    """

    def __init__(self, layout: SurfaceLayout, material_table: Texture) -> None:
        self._layout = layout
        self._rows = read_texture(material_table)

    def mean(self, material: int, channel: str) -> NDArray[np.float64] | None:
        """(components,) the mean of a stored channel over a material of the plan."""
        places = [i for i, (name, _) in enumerate(self._layout.values) if name == channel]
        if not places:
            return None
        column = self._rows[:, 1 + material].reshape(-1)
        return column[places].astype(np.float64)

    def make(
        self, edits: SurfaceEdits, object_names: Sequence[str]
    ) -> tuple[Texture, SurfaceLayout]:
        """The table, RGBA32F, and the layout of surfaces that read it.

        Behind the cache's own rows are EDIT_ROWS for the materials, by their columns; behind these
        as many for each stretch of objects that the table's width has room for. A material that the
        cache does not know is not edited: nothing of it is cached.

        Args:
            edits: of the scene.
            object_names: `SceneGeometry.object_names`; more than one may have one name.
        """
        height, columns, _ = self._rows.shape
        materials = ("", *self._layout.plan.material_names, "")
        objects = {name: e for name, e in edits.objects.items() if not e.is_neutral}
        edits_objects = not objects.keys().isdisjoint(object_names)
        width = max(columns, min(len(object_names), _WIDTH)) if edits_objects else columns
        parts = [
            np.pad(self._rows, ((0, 0), (0, width - columns), (0, 0))),
            _edit_rows(edits.materials, materials, width),
        ]
        if edits_objects:
            parts.append(_edit_rows(objects, object_names, width))
        layout = replace(self._layout, edit_row=height, edits_objects=edits_objects)
        return texture_from_array(np.concatenate(parts), "RGBA32F"), layout


def _edit_rows(
    edits: Mapping[str, SurfaceEdit], names: Sequence[str], width: int
) -> NDArray[np.float32]:
    """(EDIT_ROWS times the stretches of `width` names, width, 4)."""
    stretches = -(-len(names) // width)
    rows = np.empty((stretches, EDIT_ROWS, width, 4), dtype=np.float32)
    rows[:] = _texels(NO_EDIT)[:, None]
    for index, name in enumerate(names):
        if name in edits:
            rows[index // width, :, index % width] = _texels(edits[name])
    return rows.reshape(stretches * EDIT_ROWS, width, 4)


def _texels(edit: SurfaceEdit) -> NDArray[np.float32]:
    """(EDIT_ROWS, 4) of one edit, as `read_edit` in surface_edit.glsl reads it."""
    texels = np.zeros((EDIT_ROWS, 4), dtype=np.float32)
    texels[0, :3] = edit.color_factor
    texels[1, :3] = edit.specular_factor
    texels[2, :3] = edit.roughness, edit.roughness_offset, edit.emission
    return texels
