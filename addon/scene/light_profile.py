# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light's own nodes (an IES profile, a picture in the beam, ...) make of its light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class LightProfile:
    """What a light's power is multiplied with, by the direction of a place seen from the light.

    The light is multiplied by the picture's colour in the direction of q, and by
    r^exponent (1 + smooth) r^2 / (smooth + r^2), where q is the lit place in light space, seen
    from the light's sampled point, and r = |q|.

    Attributes:
        pixels: (H, W, 3) float32, linear Rec.709, row 0 at the bottom, bilinear between texels.
        half_width: the picture lies across the beam and covers q.xy / -q.z from -half_width to
            half_width in both; 0 for one all around the light: u = 1/2 + atan2(q.x, -q.z) / 2 pi,
            v = 1/2 + asin(q.y / r) / pi.
        exponent: of the distance in metres, beside what Cycles' lights fall off with.
        smooth: as of the Light Falloff node, square metres.
        over_area: (N, N, 3) float32, N a power of 2: what an area light emits at each place of
            its own, which its light is multiplied with too; rows along its Y, columns along its X.
            None where it emits the same everywhere.
    """

    pixels: NDArray[np.float32]
    half_width: float = 0.0
    exponent: float = 0.0
    smooth: float = 0.0
    over_area: NDArray[np.float32] | None = None
