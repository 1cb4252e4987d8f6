# SPDX-License-Identifier: GPL-3.0-or-later
"""How many cameras and texels may be spent."""

from __future__ import annotations

from dataclasses import dataclass

from .settings import PlacementSettings

MEGABYTE = 1_000_000


@dataclass(frozen=True)
class Budget:
    """What may still be spent; None is no limit.

    Attributes:
        cameras: pictures; a cube is as many as it has faces that see something, six at most.
        texels: over all pictures.
    """

    cameras: int | None
    texels: int | None

    @classmethod
    def of(cls, settings: PlacementSettings) -> Budget:
        """What the settings give; where they give texels and megabytes, the less of the two."""
        limits = [] if settings.texels is None else [settings.texels]
        if settings.megabytes is not None:
            limits.append(int(settings.megabytes * MEGABYTE / settings.bytes_per_texel))
        return cls(settings.cameras, min(limits) if limits else None)

    @property
    def limited(self) -> bool:
        """Whether there is a limit at all."""
        return self.cameras is not None or self.texels is not None

    def fits(self, cameras: int, texels: int) -> bool:
        """Whether so many pictures with so many texels together can still be paid for."""
        return (self.cameras is None or cameras <= self.cameras) and (
            self.texels is None or texels <= self.texels
        )

    def share(self, cameras: int, texels: int) -> float:
        """What they cost: the larger of their shares of what is left; at least 0.

        Without a limit all costs the same: the numbers of cubes and of perspective cameras are
        given then, and each is to gain as much as it can.
        """
        if not self.limited:
            return 1.0
        shares = []
        if self.cameras is not None:
            shares.append(cameras / max(self.cameras, 1))
        if self.texels is not None:
            shares.append(texels / max(self.texels, 1))
        return max(shares)

    def less(self, cameras: int, texels: int) -> Budget:
        """What is left after these."""
        return Budget(
            None if self.cameras is None else self.cameras - cameras,
            None if self.texels is None else self.texels - texels,
        )
