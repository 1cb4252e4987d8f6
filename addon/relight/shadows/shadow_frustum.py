# SPDX-License-Identifier: GPL-3.0-or-later
"""From where and how widely a shadow map looks: faces of a light point's surroundings.

A point light needs all six faces of a cube, an area light the five before it, a spot its cone
(or as many faces, when that is wide), a sun one parallel projection. The faces lie side by side
in one square-celled atlas.

A lamp that touches surfaces is looked from at another point for each face: its place on a disk
turned along that face. Seven disks for a spot, twelve for a point light stand for those that
Cycles turns towards each receiver, and every sample has them at other angles, which blurs what is
left of the steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...scene.frame_across import frame_across
from ...scene.light import Light
from ..light_points.light_sample import LightSample

ShadowMethod = Literal["auto", "map", "traced"]

MAX_FACES = 12
_COLUMNS = 3

# A cone wider than this wastes most of a single plane's texels: tan(60 deg) = 1.7 is already
# three times the texel density at the centre over that at the rim.
_WIDEST_CONE = np.radians(120.0)

# Texels beyond a face's border, so that the 2x2 comparison never needs a neighbouring face.
_GUARD_TEXELS = 1.0

# How much wider a touching lamp's faces are than the directions they serve. They look from
# beside its centre: nearer than four radii a receiver may fall outside and meets the border.
_PARALLAX = 1.25

# Disks across a touching spot's cone: one in the middle and a ring of six.
_RING = np.arange(6) * (np.pi / 3.0)

# How far a map reaches beyond what it must hold, as a share of its depth: above rounding.
_MARGIN = 1e-4


# Up to which shares of the farthest receiver's distance from the eye a sun's cascades reach: a
# pixel there covers in proportion to its distance.
_CASCADE_SHARES = (1.0 / 16.0, 0.25, 1.0)

# A cascade has at most this share of the next one's width, or its texels are no finer to speak of.
_WORTH_A_CASCADE = 0.6

# Fewer receivers than this (each stands for 4 x 4 pixels) are no reason for a cascade.
_FEWEST_RECEIVERS = 64


# Receivers are some of the pixels that are lit. Others lie a little beyond them: by a few
# hundredths of their extent, in small pictures.
_BETWEEN = 0.03


@dataclass(frozen=True)
class ShadowSettings:
    """How shadows are found, and how fine their maps are.

    Attributes:
        method: "map" draws shadow maps, the fast way on a GPU; "traced" traces a ray for each
            pixel, the exact way; "auto" the faster of both: see `settled`.
        mesh_method: the same for glowing objects, whose many points would each take a map.
        resolution: texels along the side of a sun's or spot's map.
        cube_resolution: texels along the side of each face of a point or area light's map.
    """

    resolution: int = 2048
    cube_resolution: int = 1024
    method: ShadowMethod = "map"
    mesh_method: ShadowMethod = "traced"

    def settled(self, *, in_software: bool) -> ShadowSettings:
        """The same without "auto": where there is no GPU, rays take a tenth of a map's time."""
        return replace(
            self,
            method=_fastest(self.method, in_software=in_software),
            mesh_method=_fastest(self.mesh_method, in_software=in_software),
        )

    def traces(self, light: Light) -> bool:
        """Whether a light's shadows are traced."""
        return (self.mesh_method if light.type == "MESH" else self.method) == "traced"


def _fastest(method: ShadowMethod, *, in_software: bool) -> ShadowMethod:
    if method != "auto":
        return method
    return "traced" if in_software else "map"


@dataclass(frozen=True)
class ShadowFrustum:
    """Where a shadow map's texels look.

    Attributes:
        origins: (F, 3) float64, world space, metres: the light's point, for each face. For a
            parallel map the centre of its window, on the plane that distances are counted from.
        centre: (3,) float64, world space: a receiver belongs to the face whose axis is nearest
            to its direction from here.
        parallel: whether it is a parallel projection (sun).
        turned: whether each face looks from its own point; they are then blended.
        face_from_world: (F, 3, 3) float64, rows right, up and back of each face. Unit rows.
        half_extents: (F,) half of each face's side: at distance 1 or, when parallel, in metres.
            The faces of a parallel map are cascades, the smallest first.
        inner_share: of that, without the guard texels.
        far: metres: how far it reaches.
        resolution: texels along a face's side.
    """

    origins: NDArray[np.float64]
    centre: NDArray[np.float64]
    parallel: bool
    turned: bool
    face_from_world: NDArray[np.float64]
    half_extents: NDArray[np.float64]
    inner_share: float
    far: float
    resolution: int

    @property
    def grid(self) -> tuple[int, int]:
        """Columns and rows of the atlas."""
        faces = len(self.face_from_world)
        columns = min(faces, _COLUMNS)
        return columns, -(-faces // columns)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the atlas, texels."""
        columns, rows = self.grid
        return columns * self.resolution, rows * self.resolution

    def cell(self, face: int) -> tuple[int, int]:
        """A face's lower left texel in the atlas."""
        row, column = divmod(face, self.grid[0])
        return column * self.resolution, row * self.resolution

    def clip_from_local(self, face: int, local_origin: NDArray[np.float64]) -> NDArray[np.float64]:
        """(4, 4) float64 from space relative to `local_origin` (world axes) to OpenGL's clip
        space of one face."""
        rotation = self.face_from_world[face]
        camera = np.eye(4)
        camera[:3, :3] = rotation
        camera[:3, 3] = rotation @ (local_origin - self.origins[face])
        clip = np.zeros((4, 4))
        clip[0, 0] = clip[1, 1] = 1.0 / self.half_extents[face]
        if self.parallel:
            clip[2, 2:] = -2.0 / self.far, -1.0
            clip[3, 3] = 1.0
        else:
            # Passes write depth themselves: z serves for clipping alone, and is half of w
            # everywhere. Where the two round to one number, whole triangles are cut off at random;
            # and with a nearest distance a lamp's own shade would be, in a landscape.
            clip[2, 2], clip[3, 2] = -0.5, -1.0
        return clip @ camera


def shadow_frustum(  # noqa: PLR0917 - what a light sees depends on as much
    light: Light,
    sample: LightSample,
    caster_bounds: NDArray[np.float64],
    receivers: NDArray[np.float64],
    settings: ShadowSettings,
    eye: NDArray[np.float64] | None = None,
) -> ShadowFrustum:
    """The frustum of one point of a light.

    Args:
        light: the light.
        sample: its point.
        caster_bounds: (2, 3) world space, the box around all that casts shadows.
        receivers: (N, 3) world space, points (or box corners) around all that is lit; a sun's
            windows are fitted to them.
        settings: resolutions.
        eye: (3,) world space: where a sun's shadows are finer; None for one window only.
    """
    if light.type == "SUN":
        groups = _cascades(receivers, eye)
        return _parallel(sample.position, caster_bounds, groups, settings.resolution)
    basis = light.axes
    half_extent, faces, resolution = 1.0, _cube(basis), settings.cube_resolution
    # What a light lights may be anywhere about the place that its shadows were moved to.
    moved = any(light.controls.shadow.offset)
    cone = _cone(light) if light.type == "SPOT" else 2.0 * np.pi
    touching = sample.on_disk is not None
    if light.type == "AREA":
        faces = faces if moved else faces[:5]
    elif cone <= _WIDEST_CONE:
        if touching:
            faces, half_extent = _flower(basis, 0.5 * cone, sample.turn)
        else:
            faces, half_extent = faces[:1], float(np.tan(0.5 * cone))
            resolution = settings.resolution
    elif touching:
        faces, half_extent = _ball(sample.turn)
    elif cone <= np.pi:
        faces = faces[:5]
    origins = sample.facing(light, -faces[:, 2])
    gaps = _corners(caster_bounds) - origins[:, None]
    far = float(np.linalg.norm(gaps, axis=-1).max()) or 1.0
    return ShadowFrustum(
        origins=origins,
        centre=light.position if touching else sample.position,
        parallel=False,
        turned=touching,
        face_from_world=faces,
        half_extents=np.full(len(faces), half_extent * _guarded(resolution)),
        inner_share=1.0 / _guarded(resolution),
        far=far * (1.0 + _MARGIN),
        resolution=resolution,
    )


def _ball(turn: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """(12, 3, 3) faces all around, at the vertices of an icosahedron, and half a face's side."""
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    one, other = np.meshgrid([-1.0, 1.0], [-golden, golden])
    pair = np.stack([np.zeros(4), one.ravel(), other.ravel()], axis=-1)
    axes = np.concatenate([np.roll(pair, shift, axis=-1) for shift in range(3)])
    axes = axes / np.hypot(1.0, golden) @ _rotation(turn)
    # Farthest from every vertex is the middle of a triangle of them.
    middle = np.arccos(np.sqrt((5.0 + 2.0 * np.sqrt(5.0)) / 15.0))
    return np.stack([_facing(axis) for axis in axes]), _PARALLAX * float(np.tan(middle))


def _rotation(turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3): one of all rotations, evenly, for (3,) numbers in [0, 1) (K. Shoemake, "Uniform
    Random Rotations", Graphics Gems III, 1992)."""
    ring, pole = np.sqrt(1.0 - turn[0]), np.sqrt(turn[0])
    a, b = 2.0 * np.pi * turn[1:]
    x, y, z, w = ring * np.sin(a), ring * np.cos(a), pole * np.sin(b), pole * np.cos(b)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def _flower(
    basis: NDArray[np.float64], half_cone: float, turn: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """(7, 3, 3) faces over a cone around the basis' -Z, and half the side of a face.

    The ring lies at two thirds of the cone: the middle's neighbourhood is then as wide as the
    ring's. The whole is turned about the axis, and the axis tilted by half of such a
    neighbourhood at most.
    """
    ring, tilt = half_cone * 2.0 / 3.0, half_cone / 3.0 * np.sqrt(turn[0])
    spin, toward = 2.0 * np.pi * turn[1], 2.0 * np.pi * turn[2]
    angles = np.append(0.0, np.full(6, ring))
    around = np.append(0.0, _RING + spin)
    # As row vectors they turn with -Z, to which the tilted face looks.
    axes = _around(angles, around) @ _facing(_around(np.array(tilt), np.array(toward)))
    faces = np.stack([_facing(axis) for axis in axes @ basis])
    # Farthest from every face's axis is the cone's rim between two of the ring.
    rim = np.arccos(
        np.cos(ring) * np.cos(half_cone) + np.sin(ring) * np.sin(half_cone) * np.cos(np.pi / 6.0)
    )
    return faces, _PARALLAX * float(np.tan(rim + half_cone / 3.0))


def _around(angle: NDArray[np.float64], around: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) unit vectors at angles from -Z."""
    across = np.sin(angle)
    return np.stack([across * np.cos(around), across * np.sin(around), -np.cos(angle)], axis=-1)


def _facing(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3, 3) rows right, up and back of a face that looks along an axis."""
    return np.stack([*frame_across(-axis), -axis])


def _guarded(resolution: int) -> float:
    return resolution / (resolution - 2.0 * _GUARD_TEXELS)


def _corners(bounds: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, 3) box to its (8, 3) corners."""
    x, y, z = np.meshgrid(*bounds.T, indexing="ij")
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)


def _cube(basis: NDArray[np.float64]) -> NDArray[np.float64]:
    """(6, 3, 3) faces looking along -Z, +X, -X, +Y, -Y and +Z of the basis."""
    x, y, z = basis
    return np.stack(
        [
            np.stack([x, y, z]),
            np.stack([z, y, -x]),
            np.stack([-z, y, x]),
            np.stack([x, z, -y]),
            np.stack([x, -z, y]),
            np.stack([-x, y, -z]),
        ]
    )


def _cone(light: Light) -> float:
    """The full angle in world space of a round cone around a spot's (stretched) cone."""
    if light.spot_size >= np.pi:
        return 2.0 * np.pi
    scale = np.linalg.norm(light.world_from_light[:3, :3], axis=0)
    wide = float(np.tan(0.5 * light.spot_size) * max(scale[0], scale[1]) / scale[2])
    return 2.0 * float(np.arctan(wide))


def _cascades(
    receivers: NDArray[np.float64], eye: NDArray[np.float64] | None
) -> list[NDArray[np.float64]]:
    """Receivers up to growing distances from the eye, the last of them all."""
    if eye is None or len(receivers) < _FEWEST_RECEIVERS:
        return [receivers]
    away = np.linalg.norm(receivers - eye, axis=1)
    groups = [receivers[away <= share * away.max()] for share in _CASCADE_SHARES]
    return [group for group in groups if len(group) >= _FEWEST_RECEIVERS] or [receivers]


def _parallel(
    toward: NDArray[np.float64],
    caster_bounds: NDArray[np.float64],
    cascades: list[NDArray[np.float64]],
    resolution: int,
) -> ShadowFrustum:
    """A sun's windows: squares around the receivers, deep enough for all casters.

    A cascade that is not much smaller than the next is left out.
    """
    rotation = np.stack([*frame_across(toward), toward])
    # Relative to the casters' own centre, so that a scene far from the origin keeps its digits.
    middle = caster_bounds.mean(axis=0)
    casters = (_corners(caster_bounds) - middle) @ rotation.T
    every = (cascades[-1] - middle) @ rotation.T if len(cascades[-1]) else casters
    depth = float(casters[:, 2].max() - min(casters[:, 2].min(), every[:, 2].min())) or 1.0
    margin = depth * _MARGIN
    halves: list[float] = []
    centres: list[list[float]] = []
    for receivers in reversed(cascades):
        lit = (receivers - middle) @ rotation.T if len(receivers) else casters
        low, high = lit[:, :2].min(axis=0), lit[:, :2].max(axis=0)
        half = 0.5 * float((high - low).max()) or depth
        if not halves or half <= _WORTH_A_CASCADE * halves[0]:
            halves.insert(0, half)
            centres.insert(0, [*(0.5 * (low + high)), casters[:, 2].max() + margin])
    origins = middle + np.array(centres) @ rotation
    return ShadowFrustum(
        origins=origins,
        centre=origins[-1],
        parallel=True,
        turned=False,
        face_from_world=np.broadcast_to(rotation, (len(halves), 3, 3)),
        half_extents=np.array(halves) * _guarded(resolution),
        inner_share=1.0 / _guarded(resolution),
        far=depth + 2.0 * margin,
        resolution=resolution,
    )


def parallel_frustum(
    toward: NDArray[np.float64],
    caster_bounds: NDArray[np.float64],
    receivers: NDArray[np.float64],
    resolution: int,
) -> ShadowFrustum:
    """A window for each of (F, 3) unit directions towards suns, at most MAX_FACES of them."""
    each = [_parallel(one, caster_bounds, [receivers], resolution) for one in toward]
    return ShadowFrustum(
        origins=np.concatenate([one.origins for one in each]),
        centre=each[0].centre,
        parallel=True,
        turned=False,
        face_from_world=np.concatenate([one.face_from_world for one in each]),
        half_extents=np.concatenate([one.half_extents for one in each]) * (1.0 + _BETWEEN),
        inner_share=each[0].inner_share,
        far=max(one.far for one in each),
        resolution=resolution,
    )
