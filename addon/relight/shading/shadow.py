# SPDX-License-Identifier: GPL-3.0-or-later
"""What the light pass asks of a shadow, whichever way it was found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...glsl.shader import Samplers
from ...glsl.uniforms import UniformBlock
from .picture_tiles import PictureTiles


@dataclass(frozen=True)
class ShadowKind:
    """What of a shadow a shader depends on.

    Attributes:
        library: the file in addon/glsl/lib/ with `float visibility(vec3 position, vec3 Ng)`: the
            share of the light's point that a surface sees, for Ng on the lit side, and `bool
            is_before(float NgoL)`: whether that is the viewer's.
        samplers: what it reads.
        blocks: its uniform blocks.
        spots: of how many spots of a light's cell it tells whether they are seen, by `int
            open_spots()`; 0 for none.
        tinted: whether `vec3 shadow_tint()` tells what sheer surfaces let through of what is seen.
    """

    library: str
    samplers: Samplers
    blocks: tuple[UniformBlock, ...] = ()
    spots: int = 0
    tinted: bool = False


class Shadow(Protocol):
    """The shadow of one point of a light."""

    @property
    def kind(self) -> ShadowKind:
        """What a shader that reads it is made of."""

    @property
    def textures(self) -> Mapping[str, Any]:
        """By the names of `kind.samplers`."""

    @property
    def lit(self) -> PictureTiles | None:
        """Where anything is seen of the point; None where that is not known before."""

    def uniforms(self, local_origin: NDArray[np.float64]) -> Mapping[str, Mapping[str, Any]]:
        """The values of `kind.blocks` for surfaces in the space around `local_origin`."""
