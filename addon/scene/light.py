# SPDX-License-Identifier: GPL-3.0-or-later
"""One light, with Cycles' radiometry.

The formulas follow Cycles' lights (src/scene/light.cpp and src/kernel/light/ of its
repository); the tests hold them against closed forms and against Cycles' own pictures.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .frame_across import frame_across
from .light_controls import NEUTRAL, LightControls
from .light_linking import UNLINKED, LightLinking
from .light_profile import LightProfile

# Beyond this full angle receivers see a disk across the axis at less than half its width.
WIDEST_FLAT_SPOT = float(np.radians(120.0))

# Blender's, and glowing objects (mesh_light.py).
LightType = Literal["POINT", "SPOT", "SUN", "AREA", "MESH"]
AreaShape = Literal["SQUARE", "RECTANGLE", "DISK", "ELLIPSE"]


# Narrower grids are shaded with this spread, radians: a light without any would need a sample
# for each of its points.
NARROWEST_SPREAD = float(np.radians(1.0))


@dataclass(frozen=True)
class Light:
    """A light under Blender's own attribute names.

    Attributes:
        name: the light object's name; an instance has its instancer's name in it.
        type: Blender's light type, or MESH.
        world_from_light: (4, 4) float64, affine; the light shines down its -Z. Scale and
            mirroring count: they stretch a spot's cone and an area light's shape.
        energy: watts, or W/m2 for a sun.
        color: (3,) float64, linear Rec.709; the temperature's colour and a constant
            Emission node's colour and strength are in it.
        exposure: stops; the light's power is doubled by each.
        normalize: whether `energy` is the whole light's power (True) or scales with its size.
        shadow_soft_size: radius of a point or spot light, metres.
        use_soft_falloff: a point or spot light is a disk facing what it lights (True) or a
            sphere (False).
        spot_size: full angle of the cone, radians.
        spot_blend: share of the cone that is soft, [0, 1].
        angle: full angle of the sun's disk, radians.
        shape, size, size_y: the area light's outline; `size_y` counts for RECTANGLE, ELLIPSE.
        spread: full angle that an area light's grid lets through, radians, (0, pi].
        diffuse_factor, specular_factor: share that reaches each lobe. Cycles has no such
            control but the light's ray visibility, so a light as read from Blender has 0 or 1.
        use_shadow: whether it casts shadows.
        controls: what shapes it beyond Blender's attributes.
        profile: what its own nodes make of its light, beside a constant colour.
        linking: which objects it lights, and which cast its shadows.
        mute: whether its layer is left out of the picture.
        solo: whether only its layer, and others with solo, are in the picture.
        warnings: one sentence for each thing about it that is not modelled.
    """

    name: str
    type: LightType
    world_from_light: NDArray[np.float64]
    energy: float
    color: NDArray[np.float64]
    exposure: float = 0.0
    normalize: bool = True
    shadow_soft_size: float = 0.0
    use_soft_falloff: bool = True
    spot_size: float = float(np.pi / 4.0)
    spot_blend: float = 0.15
    angle: float = 0.0
    shape: AreaShape = "SQUARE"
    size: float = 1.0
    size_y: float = 1.0
    spread: float = float(np.pi)
    diffuse_factor: float = 1.0
    specular_factor: float = 1.0
    use_shadow: bool = True
    controls: LightControls = NEUTRAL
    profile: LightProfile | None = None
    linking: LightLinking = UNLINKED
    mute: bool = False
    solo: bool = False
    warnings: tuple[str, ...] = ()

    @property
    def position(self) -> NDArray[np.float64]:
        """(3,) float64, world space, metres."""
        return self.world_from_light[:3, 3]

    @cached_property
    def direction(self) -> NDArray[np.float64]:
        """(3,) float64 unit vector, world space: where the light shines (its -Z)."""
        axis = -self.world_from_light[:3, 2]
        return np.asarray(axis / np.linalg.norm(axis))

    @cached_property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3) float64, rows right, up and back: light space's axes in world space.

        The object's own, made orthonormal and right-handed: back is its Z, up nearest to its Y.
        """
        back = -self.direction
        up = self.world_from_light[:3, 1]
        right = np.cross(up, back)
        if np.linalg.norm(right) <= np.finfo(np.float64).eps * np.linalg.norm(up):
            return np.stack([*frame_across(back), back])
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])

    @property
    def has_disk(self) -> bool:
        """Whether it is a lamp with an extent that Cycles turns towards each receiver."""
        return self.type in ("POINT", "SPOT") and self.shadow_soft_size > 0.0

    @property
    def has_cells(self) -> bool:
        """Whether its samples see an even share of its extent each."""
        return self.type == "AREA" or (self.type == "SUN" and self.angle > 0.0)

    @property
    def is_flat_spot(self) -> bool:
        """A spot whose cone is narrow enough for one disk across its axis to stand for it."""
        return self.type == "SPOT" and self.spot_size <= WIDEST_FLAT_SPOT

    @property
    def power(self) -> NDArray[np.float64]:
        """(3,) float64: energy, colour and exposure together, in the unit of `energy`."""
        return np.asarray(self.energy * 2.0**self.exposure * self.color)

    @property
    def is_lit(self) -> bool:
        """Whether it sends out any light."""
        return bool(np.any(self.power != 0.0)) and (self.type != "AREA" or self.area > 0.0)

    @cached_property
    def extents(self) -> NDArray[np.float64]:
        """(2, 3) float64, metres: an area light's sides as world vectors."""
        sides = (self.size, self.size_y if self.shape in ("RECTANGLE", "ELLIPSE") else self.size)
        return np.asarray(self.world_from_light[:3, :2].T * np.array(sides)[:, None])

    @property
    def is_round(self) -> bool:
        """Whether an area light is a disk or an ellipse."""
        return self.shape in ("DISK", "ELLIPSE")

    @cached_property
    def area(self) -> float:
        """An area light's surface, square metres."""
        rectangle = float(np.prod(np.linalg.norm(self.extents, axis=1)))
        return rectangle * np.pi / 4.0 if self.is_round else rectangle

    @property
    def solid_angle(self) -> float:
        """The sun's disk, steradians."""
        return float(4.0 * np.pi * np.sin(0.25 * self.angle) ** 2)

    @property
    def intensity(self) -> NDArray[np.float64]:
        """(3,) float64, what the light passes multiply by their geometric terms.

        - point, spot: radiant intensity, W/sr. Phi / (4 pi), whatever the radius; not
          normalized, a radiance of Phi / pi seen on a disk of that radius.
        - area: radiance times area, W/sr along its normal: Phi / pi.
        - sun: irradiance of a facing surface times solid angle over projected solid angle,
          W/m2, for directions spread evenly over the sun's cone.
        - mesh: radiance times area, W/sr.
        """
        if self.type == "SUN":
            return self.power * self._sun_weight
        if self.type == "MESH":
            return self.power
        if self.type == "AREA":
            return self.power / np.pi * (1.0 if self.normalize else self.area)
        if self.normalize:
            return self.power / (4.0 * np.pi)
        radius = self.shadow_soft_size
        return self.power * (radius * radius if radius > 0.0 else 1.0 / np.pi)

    @property
    def _sun_weight(self) -> float:
        if self.angle <= 0.0:
            return 1.0
        projected = np.pi * np.sin(0.5 * self.angle) ** 2
        return self.solid_angle / (projected if self.normalize else 1.0)
