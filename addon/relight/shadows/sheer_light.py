# SPDX-License-Identifier: GPL-3.0-or-later
"""What sheer surfaces let through where rays meet them: as addon/glsl/lib/sheer.glsl."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...scene.geometry import Cutout, SceneGeometry, Sheer
from .cutout_alpha import mask_alpha


class SheerLight:
    """The transmission of a geometry's materials, read as the GPU reads it: bilinearly."""

    def __init__(self, geometry: SceneGeometry) -> None:
        self._geometry = geometry
        self._of_material = {sheer.material_id: sheer for sheer in geometry.sheers}

    def through(
        self, triangle: NDArray[np.int64], barycentric: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(R, 3) the share of the light that passes.

        Args:
            triangle: (R,) triangles met, all of sheer materials.
            barycentric: (R, 2) where: the weights of corners 1 and 2.
        """
        result = np.ones((len(triangle), 3))
        material = self._geometry.material_id[triangle]
        for number in np.unique(material):
            sheer = self._of_material[int(number)]
            some = np.flatnonzero(material == number)
            if sheer.transmission.shape[:2] == (1, 1) and sheer.extension != "CLIP":
                result[some] = sheer.transmission[0, 0]
                continue
            assert self._geometry.uv is not None
            corner = self._geometry.uv[triangle[some]].astype(np.float64)
            u, v = barycentric[some, :1], barycentric[some, 1:]
            uv = (1.0 - u - v) * corner[:, 0] + u * corner[:, 1] + v * corner[:, 2]
            result[some] = transmission_at(sheer, uv)
        return result


def transmission_at(sheer: Sheer, uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) at (N, 2) texture coordinates, as `transmission` in sheer.glsl."""
    channels = []
    for each in range(3):
        # Outside of a clipped mask there is nothing: what lies there is added to all.
        outside = float(sheer.outside[each]) if sheer.extension == "CLIP" else 0.0
        plane = Cutout(0, sheer.transmission[..., each] - np.float32(outside), sheer.extension)
        channels.append(mask_alpha(plane, uv) + outside)
    return np.stack(channels, axis=-1)
