# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a cut-out material is there and where it is cut away."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scene.geometry import Cutout, SceneGeometry


def opaque_at(
    geometry: SceneGeometry, triangle: NDArray[np.int64], barycentric: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """(R,) whether the surface is there, at points on (R,) triangles.

    Args:
        geometry: with `uv`, if any of its materials has a cut-out.
        triangle: (R,) indices into the geometry's triangles.
        barycentric: (R, 2), the weights of corners 1 and 2.
    """
    opaque = np.ones(len(triangle), dtype=np.bool_)
    if geometry.uv is None:
        return opaque
    first = 1.0 - barycentric.sum(axis=-1, keepdims=True)
    weights = np.concatenate([first, barycentric], axis=-1)
    uv = np.einsum("rc,rcx->rx", weights, geometry.uv[triangle].astype(np.float64))
    for cutout in geometry.cutouts:
        ours = geometry.material_id[triangle] == cutout.material_id
        opaque[ours] = _alpha(cutout, uv[ours]) >= 0.5
    return opaque


def _alpha(cutout: Cutout, uv: NDArray[np.float64]) -> NDArray[np.float32]:
    """(R,) the nearest texel's alpha at (R, 2) texture coordinates."""
    inside = np.ones(len(uv), dtype=np.bool_)
    if cutout.extension == "REPEAT":
        uv = uv - np.floor(uv)
    elif cutout.extension == "MIRROR":
        uv = 1.0 - np.abs(np.mod(uv, 2.0) - 1.0)
    elif cutout.extension == "CLIP":
        inside = ((uv >= 0.0) & (uv < 1.0)).all(axis=-1)
    height, width = cutout.alpha.shape
    texel = np.floor(uv * [width, height])
    column, row = np.clip(texel, 0, [width - 1, height - 1]).astype(np.int64).T
    return np.where(inside, cutout.alpha[row, column], np.float32(0.0))
