# SPDX-License-Identifier: GPL-3.0-or-later
"""A relit view, read back from the GPU."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...corrmap.correspondence import Coverage


@dataclass(frozen=True)
class Picture:
    """A relit view, scene-linear Rec.709, row 0 at the bottom.

    Attributes:
        combined: (H, W, 4) float32, alpha 0 where a transparent film shows through.
        layers: (H, W, 3) float32 by light name; WORLD_LAYER and EMISSION_LAYER beside them, with
            " (scene)" behind where a light has that name.
        correspondence: (H, W, 4) float32: camera number or -1, u, v, score.
        coverage: what the cache did not show.
        samples: samples in the mean.
        lobes: of a session that splits lobes, for each light's layer (H, W, 3) float32 by the
            kind of lobe; they add up to the layer.
        glowing: the layers that are the light of glowing objects.
    """

    combined: NDArray[np.float32]
    layers: Mapping[str, NDArray[np.float32]]
    correspondence: NDArray[np.float32]
    coverage: Coverage
    samples: int
    lobes: Mapping[str, Mapping[str, NDArray[np.float32]]] = field(default_factory=dict)
    glowing: tuple[str, ...] = ()
