# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects and materials a caching camera's picture shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..camplace.frame import LocalFrame
from ..camplace.rays import RayCaster
from ..scene.geometry import SceneGeometry
from .framebuffer import DeepFramebuffer
from .plan import ChannelPlan
from .surfaces import ObjectState

# A surface counts as the one that was baked if it lies within this share of the baked depth: a
# texel's sample is up to a hundredth of a texel from its centre, which at a surface seen at 3
# degrees moves the depth by 2e-4 in a picture of 1024 texels and 90 degrees.
_NEAR = 1e-3
# Where none does, for surfaces seen at a still flatter angle, within this share.
_FAR = 0.05
# Rays start in float32: the window is at least this many of its spacings at the eye.
_SPACINGS = 64.0
# Edges that the bake met and a ray at the texel's centre does not, in texels from it.
_JITTER = 0.05


@dataclass(frozen=True)
class Seen:
    """What one picture shows.

    Attributes:
        objects: the digests of their states.
        materials: their full names.
        is_complete: False where something is seen that no triangle explains: it may be anything.
    """

    objects: frozenset[str] = frozenset()
    materials: frozenset[str] = frozenset()
    is_complete: bool = True

    def to_json(self) -> dict[str, Any]:
        """Plain values for the manifest."""
        return {
            "objects": sorted(self.objects),
            "materials": sorted(self.materials),
            "is_complete": self.is_complete,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Seen:
        """Raises KeyError or TypeError on anything that to_json() did not write."""
        return cls(
            frozenset(str(digest) for digest in data["objects"]),
            frozenset(str(name) for name in data["materials"]),
            bool(data["is_complete"]),
        )


class SurfaceSight:
    """Tells what is seen of one state of a scene. Builds what it needs when first asked."""

    def __init__(self, geometry: SceneGeometry, states: Sequence[ObjectState]) -> None:
        """`states` are those of `geometry.object_names`."""
        self._geometry = geometry
        self._states = states

    @cached_property
    def _frame(self) -> LocalFrame:
        return LocalFrame.of(self._geometry, (), None)

    @cached_property
    def _caster(self) -> RayCaster:
        # The baked depth tells what a cut-out lets through: to rays its triangles are whole.
        whole = replace(self._geometry, cutouts=(), uv=None)
        return RayCaster(self._frame.geometry_from_world(whole))

    def seen(self, framebuffer: DeepFramebuffer, plan: ChannelPlan) -> Seen:
        """What a picture shows that was baked from this state.

        Exact but for surfaces that lie in one another's plane and share a material, of which
        the picture shows either.
        """
        depth = framebuffer.channels["depth"][..., 0].astype(np.float64)
        row, column = np.nonzero(depth > 0.0)
        if not row.size:
            return Seen()
        triangles, missed = self._met(framebuffer.camera, row, column, depth[row, column])
        objects = np.unique(self._geometry.object_id[triangles])
        return Seen(
            frozenset(self._states[index].digest for index in objects),
            self._materials(framebuffer, plan, triangles),
            is_complete=not missed,
        )

    def _materials(
        self, framebuffer: DeepFramebuffer, plan: ChannelPlan, triangles: NDArray[np.int64]
    ) -> frozenset[str]:
        names = self._geometry.material_names
        ids = framebuffer.channels.get("material_id")
        if ids is None:
            return frozenset(names[i] for i in np.unique(self._geometry.material_id[triangles]))
        numbers = np.unique(np.rint(ids).astype(np.int64))
        return frozenset(plan.material_names[number - 1] for number in numbers if number > 0)

    def _met(
        self,
        camera: CachingCamera,
        row: NDArray[np.int64],
        column: NDArray[np.int64],
        depth: NDArray[np.float64],
    ) -> tuple[NDArray[np.int64], bool]:
        """The triangles at texels' depths, and whether there are texels without any."""
        local = self._frame.camera_from_world(camera)
        depth = depth / self._frame.unit
        uv = (np.stack([column, row], axis=-1) + 0.5) / camera.resolution
        found, missed = self._around(local, uv, depth, _NEAR)
        met = [found]
        uv, depth = uv[missed], depth[missed]
        for shift in ((0.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
            if not uv.size:
                break
            moved = uv + np.array(shift) * (_JITTER / camera.resolution)
            found, missed = self._around(local, moved, depth, _FAR)
            met.append(found)
            uv, depth = uv[missed], depth[missed]
        if uv.size:
            # Adaptive displacement moves surfaces away from their triangles: those in the way.
            first, missed = self._first(local, uv)
            met.append(first)
            uv = uv[missed]
        return np.unique(np.concatenate(met)), bool(uv.size)

    def _around(
        self,
        camera: CachingCamera,
        uv: NDArray[np.float64],
        depth: NDArray[np.float64],
        share: float,
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """The triangles within a share of some depths, from both sides, and where none is."""
        place = camera.unproject(np.concatenate([uv, depth[:, None]], axis=-1))
        way = place - camera.origin
        distance = np.linalg.norm(way, axis=-1)
        direction = way / distance[:, None]
        reach = np.maximum(np.abs(place).max(axis=-1), np.abs(camera.origin).max())
        window = np.maximum(share * distance, _SPACINGS * np.finfo(np.float32).eps * reach)
        before = place - window[:, None] * direction
        behind = place + window[:, None] * direction
        front = self._caster.first_hit(before, direction, 2.0 * window).triangle
        back = self._caster.first_hit(behind, -direction, 2.0 * window).triangle
        both = np.unique(np.concatenate([front, back]))
        return both[both >= 0], (front < 0) & (back < 0)

    def _first(
        self, camera: CachingCamera, uv: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """The first triangles on the way through (N, 2) places of the picture, and where none."""
        place = camera.unproject(np.concatenate([uv, np.ones((len(uv), 1))], axis=-1))
        way = place - camera.origin
        direction = way / np.linalg.norm(way, axis=-1)[:, None]
        origin = np.broadcast_to(camera.origin, direction.shape)
        hit = self._caster.first_hit(origin, direction).triangle
        return np.unique(hit[hit >= 0]), hit < 0
