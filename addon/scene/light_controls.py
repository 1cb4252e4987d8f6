# SPDX-License-Identifier: GPL-3.0-or-later
"""The cinematographer's controls of a light: what shapes it beyond what Blender's lights have.

The set follows the uberlight (F. Pellacini and K. Vidimce, Cinematic Lighting, GPU Gems 10, after
R. Barzel, Lighting Controls for Computer Cinematography, 1997). All of them work in *light space*:
the light object's axes made orthonormal, its origin at the light's centre, metres; the light
shines down its -Z. A control that is None, or at its neutral value, costs nothing.

Below, q is the lit place in light space, d = -q.z, and p its place *across the beam*: q.xy / d, at
one metre before the light; of a sun q.xy itself. docs/lights.md has all formulas.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

ShapeUse = Literal["COOKIE", "SLIDE"]


@dataclass(frozen=True)
class Superellipse:
    """The outline |x / width|^(2 / roundness) + |y / height|^(2 / roundness) = 1 and a soft edge.

    It covers a point by 1 within it, by 0 beyond the outer outline, whose half sides are
    width + width_edge and height + height_edge, and between by 1 - t^2 (3 - 2 t): t is how far
    the point is on its ray from the centre from the one outline to the other.

    Attributes:
        width, height: half of its sides. Metres; of barn doors at one metre from the light.
        width_edge, height_edge: how much further out the edge ends.
        roundness: 1 is an ellipse, towards 0 a rectangle, 2 a diamond, above it a star.
    """

    width: float
    height: float
    width_edge: float = 0.0
    height_edge: float = 0.0
    roundness: float = 1.0


@dataclass(frozen=True)
class BarnDoors:
    """A pyramid from the light's centre (of a sun: a prism) beyond which there is no light.

    The light is multiplied by 1 - density (1 - c), where c is by how much the outline covers
    p - shear (of a sun p - d shear), turned back by the rotation; behind the light c is 0.

    Attributes:
        outline: its cross section at one metre before the light.
        shear: (x, y) by how much it leans per metre, as of light through a window.
        rotation: radians, counter-clockwise as the light looks.
        density: how much light the doors take, [0, 1].
        invert: whether the light is taken within the outline and not beyond it.
    """

    outline: Superellipse
    shear: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    density: float = 1.0
    invert: bool = False


@dataclass(frozen=True)
class DistanceRange:
    """Between which distances from the light's centre there is light, metres.

    The light is multiplied by s(near - near_edge, near, r) (1 - s(far, far + far_edge, r)), where
    s is the smoothstep, or a step where its edge has no width, and r is |q|, or d along the axis.

    Attributes:
        near: nothing nearer than near - near_edge, all from near on; 0 without an edge for no
            near end, behind the light neither.
        far: all up to far, nothing beyond far + far_edge; inf for no end.
        along_axis: whether distances count along the light's axis and not all around.
    """

    near: float = 0.0
    near_edge: float = 0.0
    far: float = float("inf")
    far_edge: float = 0.0
    along_axis: bool = False


@dataclass(frozen=True)
class Falloff:
    """Light that falls off with another power of the distance than 2.

    The light is multiplied by (|q| / distance)^(2 - exponent), kept within 2^-80 and 2^80.
    A sun has no falloff, and none of this.

    Attributes:
        exponent: of the distance; 2 is physical, 0 none.
        distance: metres; there it is as bright as a physical light.
    """

    exponent: float = 2.0
    distance: float = 1.0


@dataclass(frozen=True)
class Slide:
    """A picture in the beam.

    The light is multiplied by 1 - density (1 - t). t is the picture at p - offset, turned back by
    the rotation and divided by the scale, with (0, 0) in its middle: bilinear between its texels,
    where it is transparent 1. addon/relight/filters/slide_picture.py makes one picture of all this.

    Attributes:
        pixels: (H, W, 4) float32, scene-linear, row 0 at the bottom, alpha straight.
        image: the image's name in Blender.
        use: a cookie's luminance lets light through, a slide colours it.
        invert: whether its negative, 1 - colour, is used.
        density: how much of it counts, [0, 1].
        scale: (x, y) metres that it covers at one metre before the light.
        offset: (x, y) metres by which its middle is moved there.
        rotation: radians, counter-clockwise as the light looks.
        blur: standard deviation of the blur, as a share of the picture's smaller side.
        repeat: whether it repeats, all over the space before the light.
        frame: where it does not repeat: whether t is 0 beside it and behind the light, or 1.
    """

    pixels: NDArray[np.float32]
    image: str
    use: ShapeUse = "COOKIE"
    density: float = 1.0
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    rotation: float = 0.0
    blur: float = 0.0
    repeat: bool = False
    invert: bool = False
    frame: bool = True


@dataclass(frozen=True)
class Noise:
    """Uneven light: Blender's Noise Texture in light space.

    The light is multiplied by max(0, 1 + amount (2 n - 1)). n is the Factor of a Noise Texture (3D,
    fBM, normalized, lacunarity 2, no distortion, scale 1) at scale * v + offset, where v is q,
    or projected q / |q|; of a projected sun (q.x, q.y, 0).

    Attributes:
        amount: 0 none, 1 from dark to twice as bright where the noise is at its ends.
        scale: patches per metre (of a projected noise: at one metre before the light).
        detail: octaves beside the first, [0, 15].
        roughness: share of each octave in the one before.
        offset: (3,) where in the noise the light is, in patches.
        projected: whether it runs along the rays from the light's centre, as a dirty lens.
    """

    amount: float
    scale: float = 1.0
    detail: float = 2.0
    roughness: float = 0.5
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    projected: bool = True


@dataclass(frozen=True)
class Blocker:
    """A flag: a flat superelliptical card that takes light away, and casts no other shadow.

    The light is multiplied by 1 - density c (1 - color), where c is by how much the outline
    covers the point in which the segment from the light's centre (of a sun: the ray along its
    axis) to q crosses the card's plane; 0 where it does not cross.

    Attributes:
        name: of the object that places it.
        world_from_blocker: (4, 4) float64, affine; the card lies in its xy plane.
        outline: in that object's units.
        density: how much light it takes, [0, 1].
        color: (3,) linear Rec.709 of the light that still comes through where density is 1.
        invert: a window: a card without end, with a hole of this outline.
    """

    name: str
    world_from_blocker: NDArray[np.float64]
    outline: Superellipse
    density: float = 1.0
    color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    invert: bool = False


@dataclass(frozen=True)
class ShadowControls:
    """How a light's shadows are cheated.

    With I the light's colour, Y its luminance (Rec.709) and v the visibility, diffuse light has
    the colour I + density (1 - v) (Y color - I); specular light the same, or v I where highlights
    are hidden.

    Attributes:
        color: (3,) linear Rec.709, of the light's own brightness: what shadows are filled with.
        density: 1 as dark as can be, 0 no shadow.
        softness: times the light's extent, as the shadows alone see it.
        offset: (3,) metres, world space: where the shadows come from, beside the light's centre;
            of a sun, which has no place: beside a point at one metre towards it.
        hide_highlights: whether there is no specular light in a shadow, however it is filled.
    """

    color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    density: float = 1.0
    softness: float = 1.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hide_highlights: bool = True


@dataclass(frozen=True)
class LightControls:
    """All controls of one light.

    Attributes:
        diffuse, specular: weights of the lobes, beside Blender's ray visibility.
        ambient: weight of light that reaches all that the light's shape covers, whatever way it
            faces and whether in shadow or not: ambient * albedo / pi times the irradiance of a
            surface that faces the light, where albedo is the diffuse and translucent lobes' colour.
    """

    barn_doors: BarnDoors | None = None
    distance: DistanceRange | None = None
    falloff: Falloff | None = None
    slide: Slide | None = None
    noise: Noise | None = None
    blockers: tuple[Blocker, ...] = ()
    shadow: ShadowControls = field(default_factory=ShadowControls)
    diffuse: float = 1.0
    specular: float = 1.0
    ambient: float = 0.0

    @property
    def shapes_beam(self) -> bool:
        """Whether anything of it stands in the light's beam."""
        in_beam = (self.barn_doors, self.distance, self.falloff, self.slide, self.noise)
        return any((*in_beam, self.blockers))


# Blockers that one light may have.
MOST_BLOCKERS = 32

NEUTRAL = LightControls()
