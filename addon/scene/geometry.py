# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's surfaces as plain arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .coincident import Coincident, coincident_triangles
from .mesh_copies import MeshCopies

# Triangles worked on at a time: the corners and edges of all at once would take far more memory
# than the scene, and pass through it instead of through the processor's cache.
PART = 16384


# Blender's usual Shadow Terminator Geometry Offset of an object.
TERMINATOR_OFFSET = 0.1


# Transmissions of three colours that differ by less, two steps of a display, are of one.
_GREY = 1.0 / 128.0


@dataclass(frozen=True)
class Cutout:
    """The alpha mask of one material, for the passes that rasterize its triangles.

    Attributes:
        material_id: index into `SceneGeometry.material_names`.
        alpha: (H, W) float32 in [0, 1], row 0 at v = 0. A fragment below 0.5 is cut away.
        extension: what lies outside the unit square, in Blender's terms.
    """

    material_id: int
    alpha: NDArray[np.float32]
    extension: Literal["REPEAT", "EXTEND", "CLIP", "MIRROR"]


@dataclass(frozen=True)
class Sheer:
    """A material that lets part of the light pass straight through: a layer before what lies
    behind it.

    Attributes:
        material_id: index into `SceneGeometry.material_names`.
        transmission: (H, W, 3) float32 in [0, 1], scene-linear, row 0 at v = 0: the share of the
            light that passes.
        extension: what lies outside the unit square, in Blender's terms.
        outside: (3,) float32: the transmission there, if it is CLIP.
    """

    material_id: int
    transmission: NDArray[np.float32]
    extension: Literal["REPEAT", "EXTEND", "CLIP", "MIRROR"]
    outside: NDArray[np.float32]

    @property
    def is_tinted(self) -> bool:
        """Whether it lets through some colours more than others, to be seen."""
        return bool(np.ptp(self.transmission, axis=-1).max() > _GREY)

    @property
    def at_half(self) -> Cutout:
        """The mask of those who know nothing in between: there where at most half passes."""
        opaque = (1.0 - self.transmission.mean(axis=-1)).astype(np.float32)
        return Cutout(self.material_id, opaque, self.extension)


@dataclass(frozen=True)
class SceneGeometry:
    """Triangles in world space, as Cycles would render them.

    Attributes:
        vertices: (V, 3) float64, metres, world space. All finite.
        triangles: (T, 3) int32, indices into `vertices`; no degenerate ones.
        object_id: (T,) int32, index into `object_names` (an instance has its instancer's
            own entry, so that two instances of one object differ).
        material_id: (T,) int32, index into `material_names`.
        weight: (T,) float32 in [0, 1], how much the artist cares (paper's w_i).
        camera_visible: (T,) bool, seen directly by cameras (Blender's ray visibility).
        shadow_visible: (T,) bool, casts shadows.
        uv: (T, 3, 2) float32 of the active render UV map, or None when no material has a
            cut-out that needs it.
        object_names: Blender's names.
        material_names: Blender's full names, which tell the libraries that they come from.
        cutouts: alpha masks, at most one for a material.
        sheers: materials that light passes through in part; they have no alpha mask.
        warnings: one sentence for each thing left out or approximated.
        object_states: for each of `object_names` a digest of what its materials can read of it
            beside its triangles; none for arrays that were not read from Blender.
        corner_normals: (T, 3, 2) uint16 codes (`octahedral`) of the unit normals that are
            interpolated for shading, world space, on the side of `normal`; None where every
            face is flat.
        terminator_offset: (O,) float32, for each of `object_names` below which cosine to the light
            shadow rays start above its smooth triangles; None for Blender's usual one.
        shares_mesh: (O,) bool, for each of `object_names` whether others show the same mesh; None
            where none do.
        full_names: for each of `object_names` the full name of who instances it ("" where
            nobody does) and its own, libraries in them; none for arrays likewise.
        copies: meshes that stand in it many times, of which each place's triangles are here too.
            Whoever moves vertices or leaves out triangles leaves these out.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    object_id: NDArray[np.int32]
    material_id: NDArray[np.int32]
    weight: NDArray[np.float32]
    camera_visible: NDArray[np.bool_]
    shadow_visible: NDArray[np.bool_]
    object_names: tuple[str, ...]
    material_names: tuple[str, ...]
    uv: NDArray[np.float32] | None = None
    cutouts: tuple[Cutout, ...] = ()
    sheers: tuple[Sheer, ...] = ()
    warnings: tuple[str, ...] = ()
    object_states: tuple[bytes, ...] = ()
    full_names: tuple[tuple[str, str], ...] = ()
    corner_normals: NDArray[np.uint16] | None = None
    terminator_offset: NDArray[np.float32] | None = None
    shares_mesh: NDArray[np.bool_] | None = None
    copies: tuple[MeshCopies, ...] = ()

    def __len__(self) -> int:
        return len(self.triangles)

    @cached_property
    def is_sheer(self) -> NDArray[np.bool_]:
        """(T,) which triangles let part of the light pass straight through."""
        materials = [sheer.material_id for sheer in self.sheers]
        return np.isin(self.material_id, materials)

    @cached_property
    def area(self) -> NDArray[np.float64]:
        """(T,) float64, square metres."""
        area = np.empty(len(self))
        for some in self._in_parts():
            area[some] = 0.5 * np.linalg.norm(self._edges_cross(some), axis=1)
        return area

    @cached_property
    def normal(self) -> NDArray[np.float64]:
        """(T, 3) float64 unit geometric normals, world space, by the corners' winding."""
        normal = np.empty((len(self), 3))
        for some in self._in_parts():
            normal[some] = self.normal_of(some)
        return normal

    @cached_property
    def coincident(self) -> Coincident:
        """Triangles that overlap another one in their plane, as Cycles has them in the world."""
        return coincident_triangles(self)

    def normal_of(self, triangle: NDArray[np.int64] | slice) -> NDArray[np.float64]:
        """(N, 3) the normals of some triangles (N,), for those who do not need them all."""
        cross = self._edges_cross(triangle)
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        return np.asarray(cross / np.where(length > 0.0, length, 1.0))

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) float64, lowest and highest corner of the vertices in use, metres."""
        used = np.zeros(len(self.vertices), dtype=np.bool_)
        used[self.triangles.ravel()] = True
        points = self.vertices if used.all() else self.vertices[used]
        return np.stack([points.min(axis=0), points.max(axis=0)])

    def _edges_cross(self, triangle: NDArray[np.int64] | slice) -> NDArray[np.float64]:
        """(N, 3) cross product of two edges: twice the area along the normal."""
        first, second, third = (self.vertices[self.triangles[triangle, k]] for k in range(3))
        (a, b, c), (d, e, f) = (second - first).T, (third - first).T
        # What `np.cross` gives, in half of its time.
        return np.stack([b * f - c * e, c * d - a * f, a * e - b * d], axis=-1)

    def _in_parts(self) -> Iterator[slice]:
        """All triangles, some at a time."""
        for start in range(0, len(self), PART):
            yield slice(start, start + PART)
