# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow maps kept until their light or a caster moves."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable

from ..light_points.light_sample import LightSample
from .shadow_pass import ShadowMap

# Bytes of the GPU's memory for shadow maps: sixteen of a spot take 268 MB, of an area light 403.
SHADOW_BUDGET = 1 << 30


class ShadowCache:
    """Shadow maps by light and by the point of the light that they look from.

    Points that coincide share a map: a light without extent has one for all samples of a picture.
    The maps that were not asked for the longest are dropped first.

    Args:
        budget: bytes of the GPU's memory.
    """

    def __init__(self, budget: int = SHADOW_BUDGET) -> None:
        self._budget = budget
        self._maps: OrderedDict[tuple[str, bytes], ShadowMap] = OrderedDict()

    @property
    def nbytes(self) -> int:
        """Bytes of the GPU's memory that are taken."""
        return sum(shadow.nbytes for shadow in self._maps.values())

    def get(self, light: str, sample: LightSample, draw: Callable[[], ShadowMap]) -> ShadowMap:
        """The map of a light's point; drawn if it is not kept."""
        key = (light, _key(sample))
        known = self._maps.get(key)
        if known is None:
            known = self._maps[key] = draw()
            free = self._budget - self.nbytes
            while free < 0 and len(self._maps) > 1:
                _, oldest = self._maps.popitem(last=False)
                free += oldest.nbytes
        self._maps.move_to_end(key)
        return known

    def drop(self, light: str) -> None:
        """A light moved, changed its extent or is gone."""
        for key in [key for key in self._maps if key[0] == light]:
            del self._maps[key]

    def clear(self) -> None:
        """A caster moved."""
        self._maps.clear()


def _key(sample: LightSample) -> bytes:
    on_disk = b"" if sample.on_disk is None else sample.on_disk.tobytes() + sample.turn.tobytes()
    # A lone sample is a light's centre as one of several may be, but casts as if by itself.
    return sample.position.tobytes() + on_disk + bytes([sample.count > 1])
