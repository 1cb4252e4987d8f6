# SPDX-License-Identifier: GPL-3.0-or-later
"""Where in the picture of a pinhole lies what a view sees through its lens and shutter.

*Film* coordinates are those of the reference, the frame's own camera through the middle of its
lens: pixels from the picture's bottom left corner, (0.5, 0.5) in the first pixel's middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene.exposure import Exposure
from ..scene.view import View
from .pixel_filter import pixel_offsets, pixel_offsets_around
from .visibility_samples import VisibilitySample, draw_visibility_sample, visibility_sample
from .visible_surface import VisibleSurface, VisibleSurfacePass

# Places of a sample from which a pixel looks at a light: one for each spot of a light's cell.
PLACES = 16


@dataclass(frozen=True)
class ViewLooks:
    """The samples of one view.

    Attributes:
        view: the reference.
        surfaces: rasterizes.
        exposure: what moves while the shutter is open, if anything does.
        object_count: of the geometry.
    """

    view: View
    surfaces: VisibleSurfacePass
    exposure: Exposure | None = None
    object_count: int = 0

    @property
    def is_blurred(self) -> bool:
        """Whether samples are seen from anywhere but the reference."""
        return self.view.lens is not None or self.exposure is not None

    def offset(self, k: int) -> tuple[float, float]:
        """Sample k's place in the pixel, (x, y) pixels from its centre."""
        x, y = pixel_offsets(self.view.pixel_filter, 1, first=k)[0]
        return float(x), float(y)

    def around(self, k: int) -> NDArray[np.float64]:
        """(PLACES, 2) from sample k's place in the pixel to others, the first the place itself: of
        every sample these fill the pixel, and those of all samples together more finely."""
        return pixel_offsets_around(self.view.pixel_filter, k, PLACES) - self.offset(k)

    def pinhole(self, k: int, *, with_objects: bool = False) -> VisibleSurface:
        """What the reference sees at sample k's place in the pixels."""
        return self.surfaces.draw(self.view, self.offset(k), with_objects=with_objects)

    def sample(self, k: int) -> VisibilitySample:
        """Sample k's look."""
        return visibility_sample(self.view, k, self.exposure, self.object_count)

    def visible(self, k: int, *, with_objects: bool = False) -> VisibleSurface:
        """What sample k sees, where the geometry has it."""
        return draw_visibility_sample(
            self.surfaces, self.view, self.sample(k), with_objects=with_objects
        )

    def film(
        self, k: int, pixel: NDArray[np.int64], position: NDArray[np.float32]
    ) -> NDArray[np.float64]:
        """(N, 2) where on the film lies what sample k hits at some pixels.

        Args:
            k: the sample.
            pixel: (N,) row by row from the bottom.
            position: (N, 4) as `VisibleSurface.position`. What hits nothing lies in a direction.
        """
        row, column = np.divmod(pixel, self.view.width)
        sample = self.sample(k)
        centres = np.stack([column, row], axis=1) + 0.5 + np.array(sample.offset)
        if not self.is_blurred:
            return centres
        world = position[:, :3].astype(np.float64) + self.surfaces.origin
        if self.view.perspective:
            _, direction = sample.view.rays(centres)
            # So far away that from where it is seen makes no difference.
            away = self.view.origin + direction * _FAR * (1.0 + np.abs(self.view.origin).max())
            world = np.where(position[:, 3:] > 0.0, world, away)
        x, y, _, w = self.view.project(world).T
        seen = np.isfinite(x) & np.isfinite(y) & (w > 0.0)
        if not self.view.perspective:
            seen &= position[:, 3] > 0.0
        return np.where(seen[:, None], np.stack([x, y], axis=1), centres)


# Metres for each metre: beyond float32's precision of any nearer place.
_FAR = 1e8
