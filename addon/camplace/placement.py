# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the caching cameras stand, and what that was decided on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .camera import CachingCamera
from .spheres import Spheres


@dataclass(frozen=True)
class Placement:
    """The cameras and the evidence for them; all in metres and world space.

    Attributes:
        cameras: in the order of choice, primary cameras first.
        spheres: the maximal spheres; a cube face's `source` is an index into them.
        box: (2, 3) float64, the box of interest.
        sample_point, sample_normal: (S, 3) float64.
        sample_weight: (S,) float64, together 1.
        from_view: (S,) bool, the samples that were shot through the views' pixels.
        quality: (S,) float64, 0 where no camera covers a sample, else up to 1, where a texel is
            no larger than the view's pixel.
        coverage: (C,) float64, share of the weight that is covered after each camera.
        sharpness: (C,) float64, mean quality by weight after each camera.
        warnings: one sentence for each thing that the user should know.
    """

    cameras: tuple[CachingCamera, ...]
    spheres: Spheres
    box: NDArray[np.float64]
    sample_point: NDArray[np.float64]
    sample_normal: NDArray[np.float64]
    sample_weight: NDArray[np.float64]
    from_view: NDArray[np.bool_]
    quality: NDArray[np.float64]
    coverage: NDArray[np.float64]
    sharpness: NDArray[np.float64]
    warnings: tuple[str, ...] = ()

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(S,) which samples at least one camera covers."""
        return self.quality > 0.0
