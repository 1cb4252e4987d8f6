# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin of addon/glsl/lib/highlight.glsl: a lobe's light from a cell of a light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from addon.scene.frame_across import frame_across

from .bsdf import Lobe, dot
from .normal_bend import bend_of_lobe, growth

Array = NDArray[np.float64]

LEAST_MASS, SMALL_CELL_SQ = 1e-4, 0.01
# Gauss' points and weights on [0, 1].
_POINTS, _WEIGHTS = (x.copy() for x in np.polynomial.legendre.leggauss(3))
_POINTS, _WEIGHTS = 0.5 + 0.5 * _POINTS, 0.5 * _WEIGHTS


@dataclass(frozen=True)
class Cells:
    """What a cell of a light is to each pixel.

    Attributes:
        corners: (H, W, C, 3) from the pixel to the cell's corners, of any length.
        angular_sq: (H, W) squared angular radius of the cell.
        radiance: (H, W) of the cell for an intensity of 1; 0 where it can't be seen.
    """

    corners: Array
    angular_sq: Array
    radiance: Array


@dataclass(frozen=True)
class HalfVector:
    """Where the smooth terms of a lobe are taken, the normal N there, and the mass (H, W) of its
    facets."""

    mass: Array
    N: Array
    L: Array
    LoH: Array
    NoH: Array
    NoL: Array


def is_point(lobe: Lobe, cells: Cells) -> NDArray[np.bool_]:
    """(H, W) where the cell is small beside the lobe, or the lobe is Phong's."""
    small = cells.angular_sq < SMALL_CELL_SQ * np.maximum(lobe.roughness**4, 2e-10)
    bent = _own_frame(lobe)[3].any(axis=-1)
    return np.asarray((small & ~bent) | (lobe.distribution == 4.0))


def half_alphas(lobe: Lobe, cells: Cells) -> Array:
    """(H, W, 2) the lobe's alpha along its axes, as the cell sees it."""
    return _frame(lobe, cells).alphas


def half_slopes(lobe: Lobe, cells: Cells, ways: Array) -> tuple[Array, Array]:
    """Of half vectors of V and (H, W, S, 3) ways to a light: slopes over alpha (H, W, S, 2), and
    the cosines (H, W, S) of the ways with the lobe's normal."""
    return _slopes(lobe, _frame(lobe, cells), ways)


def _slopes(lobe: Lobe, frame: _Frame, ways: Array) -> tuple[Array, Array]:
    directions = ways / np.linalg.norm(ways, axis=-1, keepdims=True)
    H = directions + lobe.V[..., None, :]
    x, y, z = (np.einsum("hwsi,hwi->hws", H, a) for a in (frame.X, frame.Y, lobe.N_specular))
    slopes = np.stack([x, y], axis=-1) / z[..., None] / frame.alphas[..., None, :]
    return slopes, np.einsum("hwsi,hwi->hws", directions, lobe.N_specular)


def half_vector(lobe: Lobe, cells: Cells) -> HalfVector:
    """The centre of what the cell's slopes weigh in the lobe."""
    N, V = lobe.N_specular, lobe.V
    frame = _frame(lobe, cells)
    directions, kept = _above(cells.corners, N)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = half_slopes(lobe, cells, directions)[0]
    mass, centre = _mass(lobe, np.where(kept[..., None], s, 0.0), kept, frame.alphas)
    mass *= frame.denser
    slope = centre * frame.alphas
    H, N = (N + a[..., :1] * frame.X + a[..., 1:] * frame.Y for a in (slope, frame.leaning * slope))
    H /= np.linalg.norm(H, axis=-1, keepdims=True)
    N /= np.linalg.norm(N, axis=-1, keepdims=True)
    LoH = dot(V, H)
    L = 2.0 * LoH[..., None] * H - V
    return HalfVector(mass, N, L, LoH, dot(N, H), dot(N, L))


@dataclass(frozen=True)
class _Frame:
    """Axes (H, W, 3) and alphas (H, W, 2) along them, the normals' own part of slopes (H, W, 2),
    and what the mass is to be multiplied with for it (H, W)."""

    X: Array
    Y: Array
    alphas: Array
    leaning: Array
    denser: Array


def _frame(lobe: Lobe, cells: Cells) -> _Frame:
    """As the cell sees it."""
    X, Y, alphas, bend = _own_frame(lobe)
    own = _Frame(X, Y, alphas, bend, np.ones(bend.shape[:2]))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        slopes, heights = _slopes(lobe, own, cells.corners)
        grown, denser, leaning = growth(*_place(slopes, heights > 0.0), bend)
    is_ggx = lobe.distribution <= 1.5
    grown = np.where(is_ggx[..., None], grown, 0.5 * bend)
    return _Frame(
        X,
        Y,
        alphas * np.sqrt(1.0 + grown),
        np.where(is_ggx[..., None], leaning, grown / (1.0 + grown)),
        np.where(is_ggx & bend.any(axis=-1), denser, 1.0),
    )


def _place(slopes: Array, above: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Of polygons (H, W, C, 2) the point nearest to the middle (H, W, 2), of edges whose ends are
    both above the horizon (H, W, C), and the variance of the corners that are (H, W)."""
    count = np.maximum(above.sum(axis=-1), 1)[..., None]
    kept = np.where(above[..., None], slopes, 0.0)
    mean = kept.sum(axis=2) / count
    apart = np.where(above[..., None], slopes - mean[:, :, None], 0.0)
    spread = np.sum(apart**2, axis=(2, 3)) / count[..., 0]
    start, end = np.roll(kept, 1, axis=2), kept
    whole = above & np.roll(above, 1, axis=2)
    along = end - start
    length_sq = np.sum(along**2, axis=-1)
    part = np.where(
        length_sq > 0.0,
        np.clip(-np.sum(start * along, axis=-1) / np.where(length_sq > 0.0, length_sq, 1.0), 0, 1),
        0.0,
    )
    points = start + part[..., None] * along
    far = np.where(whole, np.linalg.norm(points, axis=-1), np.inf)
    nearest = np.take_along_axis(points, np.argmin(far, axis=2)[..., None, None], axis=2)[:, :, 0]
    turn = start[..., 0] * end[..., 1] - start[..., 1] * end[..., 0]
    around = np.maximum((whole & (turn >= 0)).sum(axis=2), (whole & (turn <= 0)).sum(axis=2))
    nearest = np.where(whole.any(axis=2)[..., None], nearest, 0.0)
    return np.where((around == slopes.shape[2])[..., None], 0.0, nearest), spread


def _own_frame(lobe: Lobe) -> tuple[Array, Array, Array, Array]:
    N = lobe.N_specular
    alpha = np.maximum(lobe.roughness**2, np.sqrt(2e-10))
    any_frame = np.apply_along_axis(lambda n: frame_across(n).ravel(), -1, N)
    Y = np.cross(N, lobe.tangent)
    length = np.linalg.norm(Y, axis=-1, keepdims=True)
    turned = ((lobe.aspect != 1.0) & (lobe.distribution < 3.5))[..., None] & (length > 0.0)
    Y = np.where(turned, Y / np.where(length > 0.0, length, 1.0), any_frame[..., 3:])
    X = np.where(turned, np.cross(Y, N), any_frame[..., :3])
    aspect = np.where(turned[..., 0], lobe.aspect, 1.0)
    return bend_of_lobe(X, Y, alpha / aspect, alpha * aspect, lobe.bend)


def _above(corners: Array, N: Array) -> tuple[Array, NDArray[np.bool_]]:
    """The polygon cut at the horizon, with at most two corners for each that was there:
    (H, W, 2 C, 3), and which of them count."""
    heights = np.einsum("hwci,hwi->hwc", corners, N)
    after, next_heights = np.roll(corners, -1, axis=2), np.roll(heights, -1, axis=2)
    crosses = (heights > 0.0) != (next_heights > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(crosses, heights / (heights - next_heights), 0.0)[..., None]
    horizon = corners + t * (after - corners)
    both = np.stack([corners, horizon], axis=3)
    kept = np.stack([heights > 0.0, crosses], axis=3)
    shape = (*corners.shape[:2], 2 * corners.shape[2])
    both, kept = both.reshape(*shape, 3), kept.reshape(shape)
    return np.where(kept[..., None], both, N[..., None, :]), kept


def _mass(lobe: Lobe, s: Array, kept: NDArray[np.bool_], alphas: Array) -> tuple[Array, Array]:
    """The mass (H, W) and its centre (H, W, 2) of the polygons (H, W, C, 2)."""
    mass, moment = np.zeros(s.shape[:2]), np.zeros((*s.shape[:2], 2))
    radial, area, density = np.zeros((*mass.shape, 3)), np.zeros_like(mass), np.zeros_like(mass)
    corners = np.zeros_like(moment)
    for i in range(s.shape[2]):
        # From each corner that counts to the next one that does.
        has, q = np.zeros(s.shape[:2], dtype=bool), s[:, :, i]
        for step in range(1, s.shape[2] + 1):
            j = (i + step) % s.shape[2]
            q = np.where((~has & kept[..., j])[..., None], s[:, :, j], q)
            has |= kept[..., j]
        p, on = s[:, :, i], kept[..., i]
        along = q - p
        length = np.linalg.norm(along, axis=-1)
        on &= length > 0.0
        along = along / np.where(on, length, 1.0)[..., None]
        outward = np.stack([along[..., 1], -along[..., 0]], axis=-1)
        height = dot(p, outward)
        width = np.hypot(1.0, height)
        angle = np.arctan(dot(q, along) / width) - np.arctan(dot(p, along) / width)
        mass += np.where(on, height * angle / width, 0.0)
        moment -= np.where(on, angle / width, 0.0)[..., None] * outward
        area += np.where(on, height * length, 0.0)
        density += np.where(kept[..., i], 1.0 / (1.0 + dot(q, q)) ** 2, 0.0)
        corners += np.where(kept[..., i, None], q, 0.0)
        radial += np.where(on[..., None], _radial(lobe, p, q, alphas), 0.0)
    sign = np.where(mass < 0.0, -0.5, 0.5) / np.pi
    mass, moment = mass * sign, moment * sign[..., None]
    count = np.maximum(kept.sum(axis=-1), 1)
    far = mass < LEAST_MASS
    middle = corners / count[..., None]
    density = (4.0 * density / count + 5.0 / (1.0 + dot(middle, middle)) ** 2) / 9.0
    centre = np.where(far[..., None], middle, moment / np.maximum(mass, 1e-30)[..., None])
    mass = np.where(far, 0.5 / np.pi * np.abs(area) * density, mass)
    everything = np.where(np.abs(radial[..., 2]) > np.pi, radial[..., 0], 0.0)
    other = 0.5 / np.pi * np.abs(everything - radial[..., 1])
    return np.where(lobe.distribution > 1.5, other, mass), centre


def _radial(lobe: Lobe, p: Array, q: Array, alphas: Array) -> Array:
    """(H, W, 3) an edge's: a lobe's mass times 2 pi in three directions, what of that is beyond
    the edge, and the angle."""
    turn = p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
    angle = np.arctan2(turn, dot(p, q))
    total = np.zeros((*turn.shape, 2))
    start = np.arctan2(p[..., 1], p[..., 0])
    for point, weight in zip(_POINTS, _WEIGHTS, strict=True):
        at = start + point * angle
        ray = np.stack([np.cos(at), np.sin(at)], axis=-1)
        # Where the ray meets the edge's line.
        d = q - p
        cross = ray[..., 0] * d[..., 1] - ray[..., 1] * d[..., 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            far = np.abs(np.where(cross != 0.0, turn / cross, 0.0))
        total += weight * _beyond(lobe, far[..., None] * ray, alphas)
    return np.concatenate([total, np.ones((*turn.shape, 1))], axis=-1) * angle[..., None]


def _beyond(lobe: Lobe, s: Array, alphas: Array) -> Array:
    """(H, W, 2)."""
    s_sq, slope_sq = dot(s, s), dot(s * alphas, s * alphas)
    alpha_sq = np.where(s_sq > 0.0, slope_sq / np.maximum(s_sq, 1e-300), alphas[..., 0] ** 2)
    n_plus_1 = np.maximum(2.0 / alpha_sq - 1.0, 1e-6)
    norm = np.sqrt(np.prod(np.maximum(2.0 / alphas**2 - 1.0, 0.0), axis=-1)) * np.prod(alphas, -1)
    power = (norm / (alpha_sq * n_plus_1))[..., None] * np.stack(
        [np.ones_like(s_sq), (1.0 + slope_sq) ** (-0.5 * n_plus_1)], axis=-1
    )
    beckmann = np.stack([np.ones_like(s_sq), np.exp(-s_sq)], axis=-1)
    is_beckmann = (lobe.distribution < 2.5) | (lobe.distribution > 5.5)
    return np.where(is_beckmann[..., None], beckmann, power)
