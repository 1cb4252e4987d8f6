# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user may choose about the placement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

# The paper's resolutions (III.1.C), texels along a side.
RESOLUTIONS = (256, 512, 1024, 2048)


@dataclass(frozen=True)
class PlacementSettings:
    """The knobs of `place_cameras`.

    Attributes:
        seed: of every random choice; the same seed gives the same cameras.
        primaries: most primary cameras; each is a cube of six faces.
        secondaries: most secondary (perspective) cameras.
        view_samples: sample points shot through the pixels of the views and of the views from a
            little elsewhere, over all of them.
        area_samples: sample points spread by weight and area (equation 2).
        view_share: share of the whole weight that the view samples carry, in [0, 1].
        grid_cells: cells of the voting grid along the box's longest side (paper's n).
        rays: rays that a sample point sends into its hemisphere to vote (paper's n rays).
        candidates: strongest cells whose real gain is tested before a camera is chosen.
        sphere_searches: stop after so many searches in a row that found no new maximal sphere
            (paper's k).
        least_gain: stop adding cameras when the best one would raise the score by less; the
            score runs from 0 to 1.
        max_resolution: most texels along a picture's side that will be baked, one of
            RESOLUTIONS. Cameras are judged by what they see then; they ask for as many as they
            need, for a finer bake later, unless texels are counted.
        bounds: (2, 3) float64, lowest and highest corner of the box of interest, metres, world
            space; None takes it from the views.
        cameras: most pictures; a cube is as many as it has faces that see something, six at
            most. This and the next two are budgets: where any is given, `primaries` and
            `secondaries` do not count, cubes and perspective cameras compete by what they gain
            for what they cost, and every budget given is kept exactly.
        texels: most texels, over all pictures.
        megabytes: as `texels`, in 10^6 bytes, at `bytes_per_texel`.
        bytes_per_texel: what a texel takes before compression. Which channels a scene needs
            is known only once it is baked; all of them together take 50 bytes.
        offer_views: also try the views' own viewpoints as places for secondary cameras. A shot
            whose camera hardly moves is then cached best; the paper has no such candidates.
    """

    seed: int = 0
    primaries: int = 1
    secondaries: int = 8
    view_samples: int = 8192
    area_samples: int = 4096
    view_share: float = 0.85
    grid_cells: int = 128
    rays: int = 12
    candidates: int = 32
    sphere_searches: int = 50
    least_gain: float = 1e-3
    max_resolution: int = 2048
    bounds: NDArray[np.float64] | None = None
    cameras: int | None = None
    texels: int | None = None
    megabytes: float | None = None
    bytes_per_texel: float = 50.0
    offer_views: bool = False

    def check(self) -> None:
        """Raises InputError for the first value that cannot be used."""
        for name in ("view_samples", "area_samples", "rays", "candidates", "sphere_searches"):
            if getattr(self, name) < 1:
                raise InputError(f"The placement setting {name} must be at least 1.")
        for name in ("seed", "primaries", "secondaries"):
            if getattr(self, name) < 0:
                raise InputError(f"The placement setting {name} must not be negative.")
        if not self.budgeted and self.primaries + self.secondaries < 1:
            raise InputError("Ask for at least one primary or secondary camera.")
        if not 2 <= self.grid_cells <= 512:
            raise InputError("The voting grid must have between 2 and 512 cells along a side.")
        if not 0.0 <= self.view_share <= 1.0:
            raise InputError("The placement setting view_share must be between 0 and 1.")
        if self.max_resolution not in RESOLUTIONS:
            raise InputError(f"The highest resolution must be one of {RESOLUTIONS}.")
        self._check_budget()
        self._check_bounds()

    @property
    def budgeted(self) -> bool:
        """Whether a budget replaces the numbers of primary and secondary cameras."""
        return any(b is not None for b in (self.cameras, self.texels, self.megabytes))

    def _check_budget(self) -> None:
        if self.cameras is not None and self.cameras < 1:
            raise InputError("The budget must be at least 1 caching camera.")
        if not (np.isfinite(self.bytes_per_texel) and self.bytes_per_texel > 0.0):
            raise InputError("The placement setting bytes_per_texel must be above 0.")
        least = RESOLUTIONS[0] ** 2
        if self.texels is not None and self.texels < least:
            raise InputError(
                f"The budget must be at least {least} texels: one picture of {RESOLUTIONS[0]} x "
                f"{RESOLUTIONS[0]}."
            )
        megabytes = least * self.bytes_per_texel / 1e6
        if self.megabytes is not None and not megabytes <= self.megabytes < np.inf:
            raise InputError(
                f"The budget must be at least {megabytes:.3g} megabytes: one picture of "
                f"{RESOLUTIONS[0]} x {RESOLUTIONS[0]}."
            )

    def _check_bounds(self) -> None:
        if self.bounds is None:
            return
        bounds = np.asarray(self.bounds, dtype=np.float64)
        if bounds.shape != (2, 3) or not np.isfinite(bounds).all():
            raise InputError("The box of interest must be two corners of three finite numbers.")
        if not (bounds[1] > bounds[0]).all():
            raise InputError("The box of interest is empty: give its lowest corner first.")
