# SPDX-License-Identifier: GPL-3.0-or-later
"""Which triangle each pixel sees, by rays: what the rasterizer says, faster where there is no GPU.

A software rasterizer takes its time for every triangle, one after the other; embree's tree takes it
for every pixel, on all cores, and is there already where shadows are traced.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camplace.embree_mesh import EmbreeMesh
from ..camplace.parallel import in_parts
from ..glsl.shader import Texture, draws_in_software, texture_from_array
from ..scene.view import View
from .geometry_buffer import GeometryBuffer
from .local_scene import LocalScene
from .pixel_rays import clip_range
from .seen_triangles import RayHits

# With fewer triangles the rasterizer is as fast: it takes 0.08 microseconds for one, and a ray 0.1
# on two cores, of which 640x480 pixels need 300,000.
LEAST_TRIANGLES = 400_000

# Pixels at once, in whole rows.
_PART = 1 << 14

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TracedTriangles:
    """What the pixels of one sample see.

    Attributes:
        triangles: RG32F, as `VisibleSurface.triangles`.
        depth: R32F, metres along the camera's axis.
        hits: the same for the processor.
    """

    triangles: Texture
    depth: Texture
    hits: RayHits


class TrianglesByRay:
    """Finds them.

    Args:
        geometry: the scene on the GPU, which numbers the triangles.
        scene: the same for rays.
        least: fewer triangles are left to the rasterizer.
        software: whether there is no GPU; None to find out.
    """

    def __init__(
        self,
        geometry: GeometryBuffer,
        scene: LocalScene,
        least: int = LEAST_TRIANGLES,
        *,
        software: bool | None = None,
    ) -> None:
        self._geometry = geometry
        self._scene = scene
        slow = draws_in_software() if software is None else software
        self._pays = slow and geometry.triangle_count >= least and not geometry.has_cutouts
        self._pays = self._pays and not geometry.has_sheer
        self._mesh: EmbreeMesh | None = None

    @property
    def pays(self) -> bool:
        """Whether it is faster: many triangles, no GPU, and a tree that somebody else needed."""
        visible = self._scene.geometry.camera_visible
        if self._pays and self._mesh is None and self._scene.has_mesh(visible):
            self._mesh = self._scene.mesh(visible)
        return self._mesh is not None

    def find(self, view: View, rays: dict[str, Any]) -> TracedTriangles:
        """Look at it.

        Args:
            view: whose picture it is.
            rays: of its pixels, `pixel_rays`.

        Raises:
            RuntimeError: it does not pay.
        """
        mesh = self._mesh
        if mesh is None:
            raise RuntimeError("there is no tree of what cameras see")
        scale, shift, parallel, _ = rays["clip"]
        first = -shift / scale if parallel else clip_range(view)[0]
        reach = (1.0 - shift) / scale - first
        origin = [rays[name][:3] for name in ("origin", "origin_x", "origin_y")]
        toward = [rays[name][:3] for name in ("direction", "direction_x", "direction_y")]
        width, count = view.width, view.width * view.height
        triangles = np.empty((count, 2), dtype=np.float32)
        depth, place = np.empty(count, dtype=np.float32), np.empty((3, count), dtype=np.float32)
        met, codes = np.empty(count, dtype=np.int32), self._geometry.codes
        x, y = np.arange(width) + 0.5, np.arange(view.height)[:, None] + 0.5

        def look(rows: slice) -> None:
            part = slice(rows.start * width, rows.stop * width)
            start, direction = np.empty((2, 3, part.stop - part.start), dtype=np.float32)
            for axis in range(3):
                o, d = ([each[axis] for each in vectors] for vectors in (origin, toward))
                _sweep(direction[axis], d[0] + y[rows] * d[2], x * d[1])
                _sweep(start[axis], o[0] + y[rows] * o[2], x * o[1])
                start[axis] += np.float32(first) * direction[axis]
            hit, along = mesh.first(start.T, direction.T, reach)
            triangles[part] = codes.encode(hit)
            np.add(along, first, out=depth[part])
            met[part] = hit
            np.multiply(direction, along, out=place[:, part])
            place[:, part] += start

        in_parts(look, view.height, max(_PART // width, 1))
        shape = (view.height, view.width)
        return TracedTriangles(
            texture_from_array(triangles.reshape(*shape, 2), "RG32F"),
            texture_from_array(depth.reshape(*shape, 1), "R32F"),
            RayHits(met, place),
        )


def _sweep(picture: NDArray[np.float32], of_row: Array, of_column: Array) -> None:
    """Write what each row (R, 1) and column (C,) of a picture (R C,) add up to."""
    out = picture.reshape(len(of_row), len(of_column))
    np.add(of_row, of_column, out=out, casting="same_kind")
