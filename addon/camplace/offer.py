# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras that may be chosen: what they cover, gain and cost."""

from __future__ import annotations

from dataclasses import dataclass, replace

from .camera import CachingCamera
from .coverage import Seen


@dataclass(frozen=True)
class Choice:
    """A camera in the local frame, and what it covers at its resolution."""

    camera: CachingCamera
    seen: Seen

    @property
    def texels(self) -> int:
        """In its picture."""
        return self.camera.resolution**2

    def at(self, resolution: int) -> Choice:
        """The same camera with another resolution."""
        coarser = self.camera.resolution / resolution
        return Choice(
            replace(self.camera, resolution=resolution),
            replace(self.seen, texel=self.seen.texel * coarser),
        )


# A perspective camera, or the faces of a cube.
Group = tuple[Choice, ...]


@dataclass(frozen=True)
class Offer:
    """What could be chosen next.

    Attributes:
        group: the cameras.
        gained: what the score would rise by.
        cameras, texels: what would be spent.
        instead_of: number of the chosen group that it replaces, by one with more texels.
        cube: the candidate that it was made of, if it is a cube.
    """

    group: Group
    gained: float
    cameras: int
    texels: int
    instead_of: int | None = None
    cube: Group | None = None
