# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects and materials a caching camera's picture shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..camplace.frame import LocalFrame
from ..camplace.parallel import in_parts
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
# Every n-th texel along both axes is looked at from behind too.
_COARSE = 4
# Farther than any scene, in units of a way.
_ENDLESS = np.float32(1e30)
# Texels that one thread works on at a time: their arrays stay in a processor's cache.
_CHUNK = 8192
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
    def _surfaces(self) -> _Surfaces:
        return _Surfaces(self._frame.geometry_from_world(self._geometry))

    def seen(self, framebuffer: DeepFramebuffer, plan: ChannelPlan) -> Seen:
        """What a camera's pictures show that were baked from this state.

        Exact but for surfaces that lie in one another's plane and share a material, of which
        a picture shows either.
        """
        each = [self._seen_in(picture, plan) for picture in framebuffer.pictures]
        return Seen(
            frozenset().union(*(seen.objects for seen in each)),
            frozenset().union(*(seen.materials for seen in each)),
            all(seen.is_complete for seen in each),
        )

    def _seen_in(self, framebuffer: DeepFramebuffer, plan: ChannelPlan) -> Seen:
        depth = framebuffer.channels["depth"][..., 0]
        row, column = np.nonzero(depth > 0.0)
        if not row.size:
            return Seen()
        triangles, is_complete = self._met(framebuffer.camera, row, column, depth[row, column])
        objects = np.unique(self._geometry.object_id[triangles])
        return Seen(
            frozenset(self._states[index].digest for index in objects),
            self._materials(framebuffer, plan, triangles),
            is_complete,
        )

    def _materials(
        self, framebuffer: DeepFramebuffer, plan: ChannelPlan, triangles: NDArray[np.int64]
    ) -> frozenset[str]:
        names = self._geometry.material_names
        ids = framebuffer.channels.get("material_id")
        if ids is None:
            return frozenset(names[i] for i in np.unique(self._geometry.material_id[triangles]))
        counts = np.bincount(np.rint(ids).astype(np.int64).ravel())
        return frozenset(plan.material_names[n - 1] for n in np.flatnonzero(counts) if n > 0)

    def _met(
        self,
        camera: CachingCamera,
        row: NDArray[np.int64],
        column: NDArray[np.int64],
        depth: NDArray[np.float32],
    ) -> tuple[NDArray[np.int64], bool]:
        """The triangles at texels' depths, and whether they explain all of them."""
        surfaces = self._surfaces
        local = self._frame.camera_from_world(camera)
        depth = depth / np.float32(self._frame.unit)
        met = np.zeros(len(self._geometry), dtype=np.bool_)
        missed = surfaces.around(met, local, _Texels(column, row, depth), _NEAR)
        # What lies in or right behind the plane of another surface is found from behind.
        some = (row % _COARSE == 0) & (column % _COARSE == 0)
        coarse = _Texels(column[some], row[some], depth[some])
        surfaces.around(met, local, coarse, _NEAR, from_behind=True)
        rest = _Texels(column, row, depth).chosen(missed)
        for shift in ((0.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
            moved = rest.moved(_JITTER * shift[0], _JITTER * shift[1])
            rest = rest.chosen(surfaces.around(met, local, moved, _FAR))
        # Adaptive displacement moves surfaces away from their triangles: those in the way.
        rest = rest.chosen(surfaces.in_the_way(met, local, rest))
        return np.flatnonzero(met), not len(rest)


@dataclass(frozen=True)
class _Texels:
    """Places of a picture: (N,) column and row, counted in texels, and depth."""

    column: NDArray[Any]
    row: NDArray[Any]
    depth: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.depth)

    def chosen(self, which: NDArray[np.bool_]) -> _Texels:
        return _Texels(self.column[which], self.row[which], self.depth[which])

    def moved(self, x: float, y: float) -> _Texels:
        return _Texels(self.column + x, self.row + y, self.depth)


class _Surfaces:
    """Triangles that cameras see, near the origin, for rays that end at baked depths.

    A baked depth tells what a cut-out lets through: here its triangles are whole. Rays are given
    as ways, not of unit length: a surface at the way's end is met at 1.
    """

    def __init__(self, geometry: SceneGeometry) -> None:
        self._index = np.flatnonzero(geometry.camera_visible)
        self._scene = EmbreeScene(robust=True)
        if self._index.size:
            triangles = geometry.triangles[self._index]
            TriangleMesh(self._scene, geometry.vertices.astype(np.float32), triangles)
            # The first query builds the tree, which must not happen in two threads at once.
            self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def around(
        self,
        met: NDArray[np.bool_],
        camera: CachingCamera,
        texels: _Texels,
        share: float,
        *,
        from_behind: bool = False,
    ) -> NDArray[np.bool_]:
        """Mark in `met` (T,) the first triangles within a share of the texels' depths; gives
        where (N,) there is none."""
        reach = float(np.abs(camera.origin).max())

        def window(way: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            size = np.abs(way).max(axis=-1)
            least = _SPACINGS * np.finfo(np.float32).eps * (reach + size) / size
            half = np.maximum(share, least).astype(np.float32)
            start = 1.0 + half if from_behind else 1.0 - half
            return np.asarray(start, dtype=np.float32), 2.0 * half

        return self._cast(met, camera, texels, window, -1.0 if from_behind else 1.0)

    def in_the_way(
        self, met: NDArray[np.bool_], camera: CachingCamera, texels: _Texels
    ) -> NDArray[np.bool_]:
        """As `around`, of the first triangles on the whole way from the camera."""

        def window(way: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            return np.zeros(len(way), np.float32), np.full(len(way), _ENDLESS)

        return self._cast(met, camera, texels, window, 1.0)

    def _cast(
        self,
        met: NDArray[np.bool_],
        camera: CachingCamera,
        texels: _Texels,
        window: Callable[[NDArray[np.float32]], tuple[NDArray[np.float32], NDArray[np.float32]]],
        sign: float,
    ) -> NDArray[np.bool_]:
        missed = np.ones(len(texels), dtype=np.bool_)
        if not self._index.size:
            return missed
        x, y, z = camera.world_from_camera[:3, :3].T.astype(np.float32)
        origin = camera.origin.astype(np.float32)
        scale = np.float32(2.0 * camera.half_extent / camera.resolution)
        middle = np.float32(0.5 * camera.resolution - 0.5)

        def ask(chunk: slice) -> None:
            depth = texels.depth[chunk]
            right = (texels.column[chunk].astype(np.float32) - middle) * scale * depth
            up = (texels.row[chunk].astype(np.float32) - middle) * scale * depth
            way = right[:, None] * x + up[:, None] * y - depth[:, None] * z
            start, end = window(way)
            hit = self._scene.run(
                origin + start[:, None] * way, np.float32(sign) * way, dists=end, query="INTERSECT"
            )
            there = hit >= 0
            missed[chunk] = ~there
            met[self._index[hit[there]]] = True

        in_parts(ask, len(texels), _CHUNK)
        return missed
