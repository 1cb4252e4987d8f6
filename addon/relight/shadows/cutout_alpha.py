# SPDX-License-Identifier: GPL-3.0-or-later
"""Where rays pass through cut-out materials: the alpha test of addon/glsl/lib/cutout.glsl."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.geometry import Cutout, SceneGeometry


class CutoutAlpha:
    """The alpha masks of a geometry's materials, read as the GPU reads them: bilinearly.

    Caching cameras are placed by the nearest texel (`camplace.mask`), which is enough there;
    shadows of maps and of rays must have one outline.
    """

    def __init__(self, geometry: SceneGeometry) -> None:
        self._geometry = geometry
        cutouts = geometry.cutouts if geometry.uv is not None else ()
        self._of_material = {cutout.material_id: cutout for cutout in cutouts}

    def opaque(
        self, triangle: NDArray[np.int64], barycentric: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """(R,) whether a surface is there.

        Args:
            triangle: (R,) triangles met.
            barycentric: (R, 2) where: the weights of corners 1 and 2.
        """
        result = np.ones(len(triangle), dtype=np.bool_)
        if self._geometry.uv is None or not len(triangle):
            return result
        material = self._geometry.material_id[triangle]
        for number in np.unique(material):
            cutout = self._of_material.get(int(number))
            if cutout is None:
                continue
            some = np.flatnonzero(material == number)
            corner = self._geometry.uv[triangle[some]].astype(np.float64)
            u, v = barycentric[some, :1], barycentric[some, 1:]
            uv = (1.0 - u - v) * corner[:, 0] + u * corner[:, 1] + v * corner[:, 2]
            result[some] = mask_alpha(cutout, uv) >= 0.5
        return result


def mask_alpha(cutout: Cutout, uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) alpha at (N, 2) texture coordinates, as `mask_alpha` in cutout.glsl."""
    height, width = cutout.alpha.shape
    at = uv * np.array([width, height]) - 0.5
    low = np.floor(at)
    share = at - low
    column, row = low.astype(np.int64).T
    bottom = _mixed(_texel(cutout, column, row), _texel(cutout, column + 1, row), share[:, 0])
    top = _mixed(_texel(cutout, column, row + 1), _texel(cutout, column + 1, row + 1), share[:, 0])
    return _mixed(bottom, top, share[:, 1])


def _mixed(
    a: NDArray[np.float64], b: NDArray[np.float64], t: NDArray[np.float64]
) -> NDArray[np.float64]:
    return a + (b - a) * t


def _texel(
    cutout: Cutout, column: NDArray[np.int64], row: NDArray[np.int64]
) -> NDArray[np.float64]:
    height, width = cutout.alpha.shape
    if cutout.extension == "REPEAT":
        inside = (column % width, row % height)
    elif cutout.extension == "MIRROR":
        inside = (_mirrored(column, width), _mirrored(row, height))
    else:
        inside = (np.clip(column, 0, width - 1), np.clip(row, 0, height - 1))
    alpha = cutout.alpha[inside[1], inside[0]].astype(np.float64)
    if cutout.extension == "CLIP":
        alpha[(column != inside[0]) | (row != inside[1])] = 0.0
    return alpha


def _mirrored(texel: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    folded = texel % (2 * size)
    return np.asarray(np.where(folded < size, folded, 2 * size - 1 - folded))
