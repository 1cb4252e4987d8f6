# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light without filters shines on, without asking the GPU: no drawing, nothing read back.

As `incidence` in addon/glsl/lib/light.glsl, whose strength is above zero only where this says so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene.light import Light
from ..light_points.light_sample import LightSample
from .light_pass import light_uniforms
from .light_shape import spread_cone

Array = NDArray[np.floating]

# Radians that cones are taken to be wider than they are, and areas to shine behind themselves: more
# than float32's roundings move their borders. Rays from places beyond are lost, and change nothing.
_BEYOND = 1e-5


@dataclass(frozen=True)
class PlainReach:
    """One point of a light, for places in a local space.

    Attributes:
        light: the light.
        place: (3,) metres: the point; a sun's unit direction.
        axis: (3,) unit, along which an area shines.
        light_from_local: (3, 3) a spot's axes, of any common length.
    """

    light: Light
    place: Array
    axis: Array
    light_from_local: Array

    @classmethod
    def of(
        cls, light: Light, sample: LightSample, origin: NDArray[np.float64]
    ) -> PlainReach | None:
        """Of a light's point in the space around `origin` (3,); None where filters, a profile or
        each receiver's own turn of its disk take part."""
        shaped = light.profile is not None or light.controls.shapes_beam
        if shaped or sample.per_receiver:
            return None
        values = light_uniforms(light, sample, origin, np.ones(3))
        axes = np.array([values[name][:3] for name in ("spot_x", "spot_y", "spot_z")])
        place = sample.position - (0.0 if light.type == "SUN" else origin)
        return cls(light, place, light.direction, axes)

    def way(self, place: Array) -> Array:
        """(3, N) from places (3, N) to the point: metres; to a sun the unit direction. As precise
        as the places are."""
        point = self.place.astype(place.dtype)[:, None]
        return np.broadcast_to(point, place.shape) if self.light.type == "SUN" else point - place

    def shines(self, way: Array) -> NDArray[np.bool_]:
        """(N,) whether it may reach places from which it lies so (3, N)."""
        kind = self.light.type
        if kind == "SUN":
            return np.ones(way.shape[1], dtype=np.bool_)
        distance_sq = way[0] * way[0] + way[1] * way[1] + way[2] * way[2]
        if kind == "SPOT":
            return self._in_cone(way)
        if kind == "AREA":
            return self._before(way, distance_sq)
        return np.asarray(distance_sq > 0.0)

    def _in_cone(self, way: Array) -> NDArray[np.bool_]:
        widest = 2.0 * np.sin(0.5 * min(0.5 * self.light.spot_size + _BEYOND, np.pi)) ** 2
        # What leaves the lamp goes along its -z.
        x, y, z = (_along(axis, way) for axis in self.light_from_local)
        across_sq = x * x + y * y
        length = np.sqrt(across_sq + z * z)
        # 1 - cosine, by the sine where the angle is small.
        tiny = np.finfo(way.dtype).tiny
        turned = np.where(z > 0.0, across_sq / np.maximum(length + z, tiny), length - z)
        return np.asarray((turned <= widest * length) & (length > 0.0))

    def _before(self, way: Array, distance_sq: Array) -> NDArray[np.bool_]:
        height = -_along(self.axis, way)
        before = (height >= -_BEYOND * np.sqrt(distance_sq)) & (distance_sq > 0.0)
        if self.light.spread < np.pi:
            half = np.arctan(spread_cone(self.light)[0]) + _BEYOND
            across_sq = distance_sq - height * height
            before &= across_sq <= (np.tan(min(half, _UPRIGHT)) * height) ** 2
        return np.asarray(before)


def _along(axis: Array, way: Array) -> Array:
    """(N,) how far ways (3, N) go along an axis (3,)."""
    x, y, z = axis.astype(way.dtype)
    return np.asarray(x * way[0] + y * way[1] + z * way[2])


# Short of a right angle.
_UPRIGHT = 0.5 * np.pi - 1e-9
