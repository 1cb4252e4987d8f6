# SPDX-License-Identifier: GPL-3.0-or-later
"""One caching camera's deep framebuffer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from .channels import CHANNEL_BY_NAME


@dataclass(frozen=True)
class DeepFramebuffer:
    """What one caching camera sees, a value for each texel's centre.

    Attributes:
        camera: with the resolution R at which it was baked.
        channels: each stored channel's (R, R, components) float32; row 0 is v = 0, the
            picture's bottom, and column 0 is u = 0. Depth is 0 where nothing is hit, and
            so is everything else there.
    """

    camera: CachingCamera
    channels: dict[str, NDArray[np.float32]]

    def __post_init__(self) -> None:
        side = self.camera.resolution
        for name, values in self.channels.items():
            shape = (side, side, CHANNEL_BY_NAME[name].components)
            if values.shape != shape or values.dtype != np.float32:
                raise ValueError(f"{name} is {values.shape} {values.dtype}, not {shape} float32")

    @property
    def raw_bytes(self) -> int:
        """Bytes that its channels take uncompressed, at the channel table's precisions."""
        return sum(
            values.size * (2 if CHANNEL_BY_NAME[name].precision == "half" else 4)
            for name, values in self.channels.items()
        )
