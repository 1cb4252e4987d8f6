# SPDX-License-Identifier: GPL-3.0-or-later
"""What surrounds the scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class World:
    """The world's radiance.

    Attributes:
        radiance: constant worlds: (3,) float64, W/(m2 sr), linear Rec.709; None when it
            varies with direction.
        equirect: (H, W, 3) float32, W/(m2 sr): the radiance by direction in Blender's
            equirectangular mapping, row 0 at the bottom (straight down); None when constant,
            or when it varies and no one has baked it yet.
        camera_visible, diffuse_visible, glossy_visible: the world's ray visibility.
        film_transparent: the render's film lets the background through.
        fingerprint: of one that varies: what the baked picture of it must have been made from.
    """

    radiance: NDArray[np.float64] | None
    equirect: NDArray[np.float32] | None = None
    camera_visible: bool = True
    diffuse_visible: bool = True
    glossy_visible: bool = True
    film_transparent: bool = False
    fingerprint: str = ""

    @property
    def is_black(self) -> bool:
        """Whether it sends out no light; read then only for its film."""
        return self.radiance is not None and not self.radiance.any()

    @property
    def needs_baking(self) -> bool:
        """Whether it varies with direction and has no picture yet."""
        return self.radiance is None and self.equirect is None
