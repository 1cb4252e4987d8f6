# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the caching cameras stand, and what that was decided on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .camera import CachingCamera
from .coverage import WELL
from .spheres import Spheres


@dataclass(frozen=True)
class Shares:
    """What part of the placement's own samples the cameras see, 0 to 1.

    Fresh samples say a little less: cameras were aimed at these ones.

    Attributes:
        view_seen, view_well: of what the views, and the views from a little elsewhere, see, by
            their pixels and the artist's weights; NaN without views that see anything.
        area_seen, area_well: of the surface in the box that some place that was tried can see,
            by area and the artist's weights; NaN where there is none.
    """

    view_seen: float = float("nan")
    view_well: float = float("nan")
    area_seen: float = float("nan")
    area_well: float = float("nan")


@dataclass(frozen=True)
class LeftOut:
    """Why samples are not covered, as shares of the whole weight; together what is not covered.

    Attributes:
        unreachable: no place that was tried sees them.
        over_budget: another camera would have gained enough, but the budget was used up.
        too_little: no other camera would have gained enough.
    """

    unreachable: float = 0.0
    over_budget: float = 0.0
    too_little: float = 0.0


@dataclass(frozen=True)
class Placement:
    """The cameras and the evidence for them; all in metres and world space.

    Attributes:
        cameras: in the order of choice, those that were kept first, the faces of a cube together.
        spheres: the maximal spheres, then those about places near the views and about kept cubes;
            a cube face's `source` is an index into them.
        box: (2, 3) float64, the box of interest.
        sample_point, sample_normal: (S, 3) float64.
        sample_weight: (S,) float64, together 1.
        from_view: (S,) bool, the samples that were shot through pixels of the views, moved or not.
        worth: (S,) float64, what each sample is worth as the cameras see it: 0 where none does,
            at least `coverage.WELL` where one sees it well.
        seen: (C,) float64, share of the weight that is seen after each camera.
        well_seen: (C,) float64, share of the weight that is well seen after each camera.
        stop: why there are no more cameras: the budget is used up, or none would gain enough.
        shares: what the cameras see and see well, by view and by area.
        left_out: why the rest is not covered.
        kept: how many of the cameras are earlier ones, unchanged but for their clips.
        warnings: one sentence for each thing that the user should know.
    """

    cameras: tuple[CachingCamera, ...]
    spheres: Spheres
    box: NDArray[np.float64]
    sample_point: NDArray[np.float64]
    sample_normal: NDArray[np.float64]
    sample_weight: NDArray[np.float64]
    from_view: NDArray[np.bool_]
    worth: NDArray[np.float64]
    seen: NDArray[np.float64]
    well_seen: NDArray[np.float64]
    warnings: tuple[str, ...] = ()
    stop: Literal["budget", "gain"] = "gain"
    shares: Shares = Shares()
    left_out: LeftOut = LeftOut()
    kept: int = 0

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(S,) which samples at least one camera sees."""
        return self.worth > 0.0

    @property
    def well_covered(self) -> NDArray[np.bool_]:
        """(S,) which samples at least one camera sees well."""
        return self.worth >= WELL

    @property
    def texels(self) -> int:
        """Over all pictures."""
        return sum(camera.resolution**2 for camera in self.cameras)

    def report(self) -> dict[str, Any]:
        """The figures as plain values for JSON; NaN where there is nothing to be seen."""
        return {
            "seen": {"by_view": self.shares.view_seen, "by_area": self.shares.area_seen},
            "well_seen": {"by_view": self.shares.view_well, "by_area": self.shares.area_well},
            "uncovered": {
                "unreachable": self.left_out.unreachable,
                "over_budget": self.left_out.over_budget,
                "too_little_gain": self.left_out.too_little,
            },
            "stopped_by": self.stop,
            "texels": self.texels,
            "kept": self.kept,
        }
