# SPDX-License-Identifier: GPL-3.0-or-later
"""Where shadow rays start on surfaces that are shaded smoothly.

A facet turns away from the light as a whole, its interpolated normals one after the other. So it
is these that say which side of a surface is lit, and near the terminator rays start above the
facet, about where the smooth surface would be: else facets would shade themselves and each other.
The lift is Cycles' (shadow_ray_offset), by its object's Shadow Terminator Geometry Offset, and by
the `smooth_height` of the place.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...camplace.parallel import in_parts
from ...scene.geometry import TERMINATOR_OFFSET, SceneGeometry
from ...scene.octahedral import from_codes
from .smooth_height import smooth_height
from .vectors import corner_weights, dot

# Corner normals are known to 7e-5 (`octahedral`): those of a triangle whose sine to its own is
# below twice that are taken to be flat.
_FLAT_SINE = 1.5e-4

# Receivers at once: what numpy makes of them stays in the processor's cache.
_PART = 1 << 14

Array = NDArray[np.float64]


class SmoothReceivers:
    """What N receivers' corner normals say.

    Args:
        geometry: the triangles, in the receivers' space.
        triangle: (N,) which triangle each is on; -1 for unknown ones, which count as flat.
        place: (3, N) on its plane.
        facing: (3, N) unit: its normal, on the viewer's side.
        shaded: (3, N) float32, what `normal` is, if that was found elsewhere.
    """

    def __init__(
        self,
        geometry: SceneGeometry,
        triangle: NDArray[np.int32],
        place: Array,
        facing: NDArray[np.floating],
        shaded: NDArray[np.float32] | None = None,
    ) -> None:
        self._geometry = geometry
        self._triangle = triangle
        self._place = place
        self._facing = facing
        self._shaded = shaded

    @property
    def any(self) -> bool:
        """Whether any triangle of the scene is smooth."""
        return self._geometry.corner_normals is not None

    @property
    def nbytes(self) -> int:
        """What is kept once it was asked for."""
        return self._triangle.nbytes + 12 * len(self._triangle)

    @cached_property
    def normal(self) -> NDArray[np.floating]:
        """(3, N) unit, interpolated, on the viewer's side of the facet's normal."""
        if self._geometry.corner_normals is None:
            return self._facing
        if self._shaded is not None:
            known = self._triangle >= 0
            return self._shaded if known.all() else np.where(known, self._shaded, self._facing)
        normal = self._facing.astype(np.float32)

        def work(part: slice) -> None:
            some = part.start + np.flatnonzero(self._triangle[part] >= 0)
            facing = self._facing[:, some].T.astype(np.float64)
            corners, normals = self._corners(some, facing)
            flat = np.linalg.norm(np.cross(normals, facing[:, None]), axis=2).max(axis=1)
            chosen = flat > _FLAT_SINE
            some, facing, corners, normals = (
                each[chosen] for each in (some, facing, corners, normals)
            )
            first, second, third = corners.transpose(1, 2, 0)
            away = first - self._place[:, some]
            weights = corner_weights(away, second - first, third - first)
            smooth = sum(w * n for w, n in zip(weights, normals.transpose(1, 2, 0), strict=True))
            size = np.sqrt(dot(smooth, smooth))
            normal[:, some] = np.where(
                size > 0.0, smooth / np.where(size > 0.0, size, 1.0), facing.T
            )

        in_parts(work, normal.shape[1], _PART)
        return normal

    def side(self, rows: NDArray[np.integer], toward: NDArray[np.floating]) -> NDArray[np.float32]:
        """(R,) of some receivers (R,) the side that light from (3, R) shines on: 1 the viewer's,
        -1 the other."""
        return np.sign(dot(self.normal.take(rows, axis=1), toward)).astype(np.float32)

    def lift(
        self, rows: NDArray[np.integer], toward: Array, side: NDArray[np.number]
    ) -> tuple[NDArray[np.int64], Array]:
        """Where rays of some receivers start, from where they are.

        Args:
            rows: (R,) which of the N.
            toward: (3, R) unit directions to the light.
            side: (R,) the side that it shines on.

        Returns:
            (S,), (3, S): which of the R do not start where they are, and how far from there.
        """
        nothing = np.empty(0, dtype=np.int64), np.empty((3, 0))
        if self._geometry.corner_normals is None:
            return nothing
        of_facet = side * dot(self._facing.take(rows, axis=1), toward)
        cosine = side * dot(self.normal.take(rows, axis=1), toward)
        # Of the others, which are most, no more has to be known.
        some = np.flatnonzero((np.minimum(of_facet, cosine) < self.lifted_below) & (cosine > 0.0))
        some = some[self._is_smooth(rows[some])]
        if not len(some):
            return nothing
        cutoff, cosine, of_facet = self._cutoff(rows[some]), cosine[some], of_facet[some]
        safe = np.where(cutoff > 0.0, cutoff, 1.0)
        near = np.where(cosine < cutoff, 2.0 - (of_facet + cosine) / safe, 1.0 - of_facet / safe)
        amount = np.where(cutoff > 0.0, np.clip(near, 0.0, 1.0), 0.0)
        of = rows[some]
        place = self._place.take(of, axis=1)
        up = np.asarray(side[some] * self._facing.take(of, axis=1), dtype=np.float64)
        height, normal = smooth_height(self._geometry, self._triangle[of], place, up)
        return some, (amount * height) * normal

    @cached_property
    def lifted_below(self) -> float:
        """The cosine to the light from which on no ray is lifted."""
        offsets = self._geometry.terminator_offset
        return TERMINATOR_OFFSET if offsets is None else float(offsets.max(initial=0.0))

    def _cutoff(self, rows: NDArray[np.integer]) -> Array:
        """(R,) below which cosine to the light some receivers' rays are lifted."""
        offsets, triangle = self._geometry.terminator_offset, self._triangle[rows]
        if offsets is None:
            return np.full(len(rows), TERMINATOR_OFFSET)
        return np.asarray(offsets[self._geometry.object_id[triangle]], dtype=np.float64)

    def _is_smooth(self, rows: NDArray[np.integer]) -> NDArray[np.bool_]:
        """(R,) whether the normals of some receivers' triangles differ."""
        assert self._geometry.corner_normals is not None
        triangle = self._triangle[rows]
        a, b, c = self._geometry.corner_normals.take(triangle, axis=0).transpose(1, 2, 0)
        differ = (a[0] != b[0]) | (a[1] != b[1]) | (a[0] != c[0]) | (a[1] != c[1])
        return np.asarray((triangle >= 0) & differ)

    def _corners(self, rows: NDArray[np.integer], up: Array) -> tuple[Array, Array]:
        """(R, 3, 3), (R, 3, 3) the corners of some receivers' triangles, and their normals on
        the side of `up` (R, 3)."""
        geometry, triangle = self._geometry, self._triangle[rows]
        assert geometry.corner_normals is not None
        corners = geometry.vertices[geometry.triangles[triangle]]
        normals = from_codes(geometry.corner_normals[triangle]).astype(np.float64)
        below = np.einsum("nx,nx->n", geometry.normal_of(triangle), up) < 0.0
        return corners, np.where(below[:, None, None], -normals, normals)
