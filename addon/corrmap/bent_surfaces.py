# SPDX-License-Identifier: GPL-3.0-or-later
"""Where normals turn so fast that a highlight is narrower than a pixel.

A shading sample there is not shared: on one facet of a thin tube some of the pixels that see it see
the highlight, and some do not.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..caching.channels import lobe_channel
from ..scene.geometry import SceneGeometry
from ..scene.octahedral import from_codes
from .surface_layout import SurfaceLayout
from .triangle_codes import TriangleCodes
from .visible_surface import VisibleSurface

# A mirror shows lights as wide as this, radians of its normal: lamps of 4 degrees. Nothing is
# gained from taking it for sharper.
_SHARPEST = 0.02

_COLORS = ("specular_f0", "specular_f90", "layer_f0", "layer_f90")


@dataclass(frozen=True)
class BentSurfaces:
    """What tells how fast normals turn beside the highlights' width.

    Attributes:
        geometry: its triangles.
        codes: how the GPU tells them apart.
        widest: (M + 2,) float64, by 1 + material id: the turn within a pixel up to which a
            highlight is as wide as the pixel, radians; infinite of a material without highlights.
    """

    geometry: SceneGeometry
    codes: TriangleCodes
    widest: NDArray[np.float64]
    _turn: NDArray[np.float32] = field(compare=False, repr=False)

    @classmethod
    def of(
        cls,
        geometry: SceneGeometry,
        codes: TriangleCodes,
        layout: SurfaceLayout,
        table: NDArray[np.float32],
    ) -> BentSurfaces | None:
        """Of a scene; None where all faces are flat or nothing has highlights.

        Args:
            geometry: its triangles.
            codes: how the GPU tells them apart.
            layout: of the surfaces.
            table: (rows, columns, 4) their material table.
        """
        widest = _widest(layout, table)
        if geometry.corner_normals is None or not np.isfinite(widest).any():
            return None
        return cls(geometry, codes, widest, np.full(len(geometry), np.nan, dtype=np.float32))

    def turn(self, triangle: NDArray[np.int64]) -> NDArray[np.float32]:
        """(N,) radians per metre along triangles of the geometry; found when one is first asked
        for."""
        new = np.unique(triangle[np.isnan(self._turn[triangle])])
        self._turn[new] = _turns(self.geometry, new)
        return np.asarray(self._turn[triangle])

    def at(
        self,
        look: VisibleSurface,
        position: NDArray[np.float32],
        triangle: NDArray[np.float32],
    ) -> NDArray[np.bool_]:
        """(N,) where highlights are narrower than a pixel.

        Args:
            look: whose eye and pixels these are.
            position: (N, 4) as `VisibleSurface.position`.
            triangle: (N, 2) as `VisibleSurface.triangles`.
        """
        number = self.codes.decode(triangle)
        turn = self.turn(np.maximum(number, 0))
        pixel: NDArray[np.float64] | float = look.pixel
        if look.eye[3] > 0.0:
            pixel = pixel * np.linalg.norm(position[:, :3] - look.eye[:3], axis=1)
        widest = self.widest[position[:, 3].astype(np.int64)]
        return np.asarray((number >= 0) & (turn * pixel > widest))


def _turns(geometry: SceneGeometry, order: NDArray[np.int64]) -> NDArray[np.float32]:
    """(N,) the root of the summed squares of the normals' derivative along triangles."""
    assert geometry.corner_normals is not None
    a, b, c = np.moveaxis(geometry.vertices[geometry.triangles[order]], 1, 0)
    A, B, C = np.moveaxis(from_codes(geometry.corner_normals[order]).astype(np.float64), 1, 0)
    sides, turns = (b - a, c - a), (B - A, C - A)
    # |dN/dp|^2 = sum of M^-1 and the products of turns, where M has those of the sides.
    (bb, bc, cc), (BB, BC, CC) = (
        [np.einsum("tx,tx->t", x[i], x[j]) for i, j in ((0, 0), (0, 1), (1, 1))]
        for x in (sides, turns)
    )
    flat = bb * cc - bc * bc
    squared = np.divide(
        cc * BB - 2.0 * bc * BC + bb * CC, flat, out=np.zeros_like(flat), where=flat > 0.0
    )
    return np.sqrt(np.maximum(squared, 0.0)).astype(np.float32)


def _widest(layout: SurfaceLayout, table: NDArray[np.float32]) -> NDArray[np.float64]:
    """See `BentSurfaces.widest`: of several lobes the sharpest counts."""
    widest = np.full(table.shape[1], np.inf)
    for lobe in range(1, layout.plan.lobes + 1):
        colors = [_of_materials(layout, table, lobe_channel(name, lobe)) for name in _COLORS]
        shines = np.any(np.concatenate(colors) > 0.0, axis=0)
        alpha = _of_materials(layout, table, lobe_channel("roughness", lobe))[0] ** 2
        widest = np.where(shines, np.minimum(widest, np.maximum(alpha, _SHARPEST)), widest)
    widest[0] = np.inf
    return widest


def _of_materials(
    layout: SurfaceLayout, table: NDArray[np.float32], name: str
) -> NDArray[np.float64]:
    """(components, columns) a channel's constants or means by the table's columns."""
    name = layout.plan.same.get(name, name)
    constant = layout.plan.constant(name)
    if constant is not None:
        return np.repeat(np.array(constant, dtype=np.float64)[:, None], table.shape[1], axis=1)
    places, first = (
        (layout.values, 0)
        if name in layout.plan.stored
        else (layout.constants, layout.constant_row)
    )
    found = [i for i, (channel, _) in enumerate(places) if channel == name]
    return np.array([table[first + i // 4, :, i % 4] for i in found], dtype=np.float64)
