# SPDX-License-Identifier: GPL-3.0-or-later
"""One caching camera's deep framebuffer."""

from __future__ import annotations

from dataclasses import InitVar, dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..scene.octahedral import NORMAL_BYTES
from .channels import CHANNEL_BY_NAME, Precision
from .precision import wide_channels


@dataclass(frozen=True)
class DeepFramebuffer:
    """What one caching camera sees, a value for each texel's centre.

    Attributes:
        camera: with the resolution R at which it was baked.
        channels: each stored channel's (R, R, components) float32, a grey one's (R, R, 1); row
            0 is v = 0, the picture's bottom, and column 0 is u = 0. Depth is 0 where nothing is
            hit, and so is everything else there.
        wide: names of the channels that half precision is named for, but does not hold (see
            `precision`). Looked for in the values, unless the caller knows them and says so.
        behind: what lies behind sheer surfaces, nearest first: pictures of the same camera with
            the first such surface left out, the second too, and so on; empty but for where they
            show something else than the one before.
    """

    camera: CachingCamera
    channels: dict[str, NDArray[np.float32]]
    wide: frozenset[str] = field(init=False)
    known_wide: InitVar[frozenset[str] | None] = None
    behind: tuple[DeepFramebuffer, ...] = ()

    def __post_init__(self, known_wide: frozenset[str] | None) -> None:
        side = self.camera.resolution
        for name, values in self.channels.items():
            shapes = [(side, side, n) for n in (CHANNEL_BY_NAME[name].components, 1)]
            is_direction = CHANNEL_BY_NAME[name].is_direction
            if values.shape not in shapes[: 1 if is_direction else 2] or values.dtype != np.float32:
                raise ValueError(
                    f"{name} is {values.shape} {values.dtype}, not {shapes[0]} float32"
                )
        wide = wide_channels(self.channels) if known_wide is None else known_wide
        object.__setattr__(self, "wide", wide)

    @property
    def pictures(self) -> tuple[DeepFramebuffer, ...]:
        """It and what lies behind, each a picture by itself."""
        if not self.behind:
            return (self,)
        return DeepFramebuffer(self.camera, self.channels, self.wide), *self.behind

    def precision(self, name: str) -> Precision:
        """In which precision a channel is stored."""
        return "float32" if name in self.wide else CHANNEL_BY_NAME[name].precision

    @property
    def raw_bytes(self) -> int:
        """Bytes that its channels take on disk before compression."""
        total = 0
        for name, values in self.channels.items():
            if CHANNEL_BY_NAME[name].is_direction:
                total += values.size // 3 * NORMAL_BYTES
            else:
                total += values.size * (2 if self.precision(name) == "half" else 4)
        return total + sum(each.raw_bytes for each in self.behind)
