# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake's presets, for everything that offers or obeys them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Preset = Literal["draft", "balanced", "final"]

DEFAULT_PRESET: Preset = "balanced"


@dataclass(frozen=True)
class Fineness:
    """What a preset stands for.

    Attributes:
        max_resolution: texels along a caching camera's side, at most.
        occlusion_rays: rays of ambient occlusion from each texel, at most.
        texel_samples: of each texel, whose mean its colours are; 1 for those of its centre.
        note: one line for the artist.
    """

    max_resolution: int
    occlusion_rays: int
    texel_samples: int
    note: str


# The rays of hundreds of texels come together in `occlusion_filter`, so that four already leave a
# standard error below 0.02 where half is open. In a room with a window a few hundredths are open,
# and it takes 32 for an error of 2 % of that. They are a third of a plain room's bake.
PRESETS: dict[Preset, Fineness] = {
    "draft": Fineness(512, 4, 1, "Small pictures: quick to bake, soft where the view is close"),
    "balanced": Fineness(1024, 8, 4, "For lighting work"),
    "final": Fineness(2048, 32, 16, "Large pictures: slow to bake, sharp in close views"),
}
