# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a moved object changes the ambient occlusion of what a caching camera sees.

A ball of radius r at a distance d covers at most (r / d)^2 of a place's cosine-weighted hemisphere
(straight above it; less elsewhere), and that much is the most by which its coming or going
changes the place's ambient occlusion. Together, what moved may change it by LEAST without notice:
the last step of an 8-bit picture. Of what more could, the share that is behind surfaces which
stay does not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..camplace.frame import LocalFrame
from ..camplace.rays import RayCaster
from ..scene.geometry import SceneGeometry
from .framebuffer import DeepFramebuffer
from .surfaces import ObjectState

LEAST = 1.0 / 256.0
# Places of a picture that are asked for, along each side: ambient occlusion varies slowly.
_PLACES = 24
# Rays from each place to each box that may matter to it.
_RAYS = 8
# The same lift as the occlusion's own rays have (`ray_occlusion`).
_LIFT = 64.0 * float(np.finfo(np.float32).eps)


class AmbientReach:
    """The reach of what moved, among surfaces that stay.

    Attributes:
        moved: objects as they were and as they are.
    """

    def __init__(self, still: SceneGeometry, moved: Sequence[ObjectState]) -> None:
        """`still` are the solid surfaces that did not change."""
        self._still = still
        self.moved = [state for state in moved if state.radius > 0.0]

    @cached_property
    def _frame(self) -> LocalFrame | None:
        return LocalFrame.of(self._still, (), None) if len(self._still) else None

    @cached_property
    def _caster(self) -> RayCaster | None:
        if self._frame is None:
            return None
        return RayCaster(self._frame.geometry_from_world(self._still))

    def reasons(self, picture: DeepFramebuffer) -> set[str]:
        """Names of the moved objects, if they may change what a picture shows by LEAST or more."""
        places = _places(picture)
        share = np.stack([_share(places, state) for state in self.moved], axis=-1)
        if not len(places) or share.sum(axis=-1).max() < LEAST:
            return set()
        # What is too little even together need not be looked for.
        place, index = np.nonzero(share >= LEAST / len(self.moved))
        open_share = np.zeros_like(share)
        open_share[place, index] = share[place, index] * self._open(
            places[place], index, picture.camera.origin
        )
        if open_share.sum(axis=-1).max() < LEAST:
            return set()
        worst = open_share.max(axis=0)
        return {s.name for s, w in zip(self.moved, worst, strict=True) if w > 0.0}

    def _open(
        self, places: NDArray[np.float64], index: NDArray[np.int64], eye: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(N,) which share of the rays from places (N, 3) to moved boxes (N,) get there."""
        if self._caster is None or self._frame is None:
            return np.ones(len(places))
        low = self._frame.from_world(np.array([state.low for state in self.moved]))[index]
        high = self._frame.from_world(np.array([state.high for state in self.moved]))[index]
        start, eye = self._frame.from_world(places), self._frame.from_world(eye)
        to_eye = eye - start
        reach = np.maximum(np.abs(start).max(axis=-1), np.abs(eye).max())
        distance = np.maximum(np.linalg.norm(to_eye, axis=-1), np.finfo(np.float64).tiny)
        start = start + (_LIFT * reach / distance)[:, None] * to_eye
        rng = np.random.default_rng(0)
        reached = np.zeros(len(places))
        for _ in range(_RAYS):
            target = low + rng.random(low.shape) * (high - low)
            reached += ~self._caster.occluded(start, target)
        return reached / _RAYS


def _places(picture: DeepFramebuffer) -> NDArray[np.float64]:
    """(N, 3) world space: some of what a picture shows, evenly over it."""
    depth = picture.channels["depth"][..., 0].astype(np.float64)
    size = picture.camera.resolution
    some = np.unique(np.linspace(0, size - 1, min(size, _PLACES)).astype(np.int64))
    column, row = (axis.ravel() for axis in np.meshgrid(some, some))
    there = depth[row, column] > 0.0
    column, row = column[there], row[there]
    uv = (np.stack([column, row], axis=-1) + 0.5) / size
    return picture.camera.unproject(np.concatenate([uv, depth[row, column, None]], axis=-1))


def _share(places: NDArray[np.float64], state: ObjectState) -> NDArray[np.float64]:
    """(N,) the most of each place's hemisphere that the ball about an object covers."""
    distance = np.linalg.norm(places - state.center, axis=-1)
    return np.asarray((state.radius / np.maximum(distance, state.radius)) ** 2)
