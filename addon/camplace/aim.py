# SPDX-License-Identifier: GPL-3.0-or-later
"""A camera's attributes: view direction, field of view, clips, resolution (paper III.1.C)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .camera import WIDEST, CachingCamera
from .coverage import Seen, gain, seen_by_camera
from .samples import Samples
from .settings import RESOLUTIONS
from .surface_distance import sphere_directions

# A picture of a single sample would be nothing; this still holds what lies about it.
NARROWEST = np.radians(5.0)
# The outermost sample is not the outermost surface: the picture reaches a little farther.
MARGIN = 1.04
# Shares of the weight that a narrower picture may keep; leaving the outermost samples to
# another camera can more than pay for itself in density.
SHARES = (0.35, 0.6, 0.85, 1.0)
# Directions tried for a camera that samples surround.
AIMS = 32
# The resolution serves this share of the weight of what the camera covers at full density.
SERVED = 0.8
# Share of the nearest surface's distance at which the picture begins.
NEAR_SHARE = 0.5

# The six faces of a cube camera: forward and up, in the order -x +x -y +y -z +z (paper).
CUBE_FACES = (
    ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
)


def look(
    place: NDArray[np.float64], forward: NDArray[np.float64], up: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(4, 4) world_from_camera at `place` with -Z along `forward`, Y as near to `up` as can be.

    `up` must not lie along `forward`; all (3,).
    """
    back = -forward / np.linalg.norm(forward)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    world_from_camera[:3, 3] = place
    return world_from_camera


def cube_cameras(place: NDArray[np.float64], resolution: int) -> tuple[CachingCamera, ...]:
    """The six faces of a primary camera at `place` (3,); ids and clips are yet to be given."""
    return tuple(
        CachingCamera(
            id=0,
            world_from_camera=look(place, np.array(forward), np.array(up)),
            fov=0.5 * np.pi,
            near=0.0,
            far=np.inf,
            resolution=resolution,
            kind="CUBE_FACE",
            source=0,
        )
        for forward, up in CUBE_FACES
    )


def field_of_view(angles: NDArray[np.float64]) -> float:
    """Twice the largest angle (equation 4) and a margin; at most 120 degrees. Radians."""
    return float(np.clip(2.0 * MARGIN * angles.max(), NARROWEST, WIDEST))


def aimed_camera(
    place: NDArray[np.float64],
    samples: Samples,
    visible: NDArray[np.int64],
    worth: NDArray[np.float64],
    resolution: int,
) -> tuple[CachingCamera, Seen, float]:
    """The perspective camera at `place` (3,) that gains most, what it covers, and the gain.

    The paper aims at the weighted centre of the covered samples (equation 3). Three things
    differ. Each sample weighs what it can still gain, so that well seen ones do not pull.
    Directions are averaged instead of points, since a distant sample would pull by its
    distance. And where samples lie all around, or a few lie far from the rest, the centre says
    little: several aims and widths are weighed by what they really gain.

    Args:
        place: where the camera is.
        samples: all samples.
        visible: (V,) those that are seen from `place`; at least one.
        worth: (S,) what samples are worth as they are seen so far.
        resolution: texels along a side.
    """
    direction = samples.point[visible] - place
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    hope = samples.weight[visible] * (1.0 - worth[visible])
    hope = np.maximum(hope, np.finfo(np.float64).tiny)
    aim = _best_aim(direction, hope)
    angle = _angles(direction, aim)
    best: tuple[CachingCamera, Seen, float] | None = None
    for limit in _limits(angle, hope):
        kept = angle <= limit
        camera = _camera(place, direction[kept], hope[kept], resolution)
        seen = seen_by_camera(camera, samples, visible)
        gained = gain(seen, worth, samples.weight)
        if best is None or gained > best[2]:
            best = camera, seen, gained
    assert best is not None
    return best


def clip_distances(
    depth: NDArray[np.float64], nearest: float, farthest: float
) -> tuple[float, float]:
    """The clips: near = min(d_near, n_c) and far = max(d_far, f_c), as in the paper.

    The paper has fixed n_c and f_c. Here n_c is a share of the distance to the `nearest`
    surface, so that nothing is cut away, and f_c is the `farthest` corner of the scene. `depth`
    (V,) are those of the covered samples; there may be none.
    """
    near, far = NEAR_SHARE * nearest, farthest
    if depth.size:
        near, far = min(near, float(depth.min())), max(far, float(depth.max()))
    return near, far


def needed_resolution(
    seen: Seen, weight: NDArray[np.float64], resolution: int, highest: int
) -> int:
    """The lowest tier at which a texel is no larger than a pixel, for most of the weight.

    The paper goes by the number of covered samples, which says nothing about how finely they
    must be seen. Only what is seen at a usable angle counts. `seen` was measured at
    `resolution`; `weight` is (S,).
    """
    usable = seen.usable
    if not usable.any():
        return RESOLUTIONS[0]
    texel = weighted_quantile(seen.texel[usable], weight[seen.index[usable]], SERVED)
    allowed = [tier for tier in RESOLUTIONS if tier <= highest]
    enough = [tier for tier in allowed if texel * resolution / tier <= 1.0]
    return enough[0] if enough else allowed[-1]


def weighted_quantile(
    values: NDArray[np.float64], weight: NDArray[np.float64], share: float
) -> float:
    """The least of the values (V,) that has at least `share` of the weight (V,) at or below."""
    return weighted_quantiles(values, weight, (share,))[0]


def weighted_quantiles(
    values: NDArray[np.float64], weight: NDArray[np.float64], shares: Sequence[float]
) -> list[float]:
    """`weighted_quantile` for several shares, sorted once."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weight[order])
    # The last sum is the largest, so `share` of 1 finds the last value whatever the rounding.
    place = np.searchsorted(total, np.multiply(shares, total[-1]))
    return [float(value) for value in values[order[np.minimum(place, len(order) - 1)]]]


def _best_aim(direction: NDArray[np.float64], hope: NDArray[np.float64]) -> NDArray[np.float64]:
    """The direction (3,) whose widest picture holds most hope: the mean, or one of a star."""
    mean = hope @ direction
    aims = np.concatenate([mean[None], sphere_directions(AIMS)])
    aims[0] /= max(float(np.linalg.norm(mean)), np.finfo(np.float64).tiny)
    held = hope @ (direction @ aims.T >= np.cos(0.5 * WIDEST))
    return np.asarray(aims[int(np.argmax(held))])


def _limits(angle: NDArray[np.float64], hope: NDArray[np.float64]) -> list[float]:
    """For each of SHARES the angle (of those (V,) in the widest picture) that holds so much."""
    within = angle <= 0.5 * WIDEST
    if not within.any():
        return [np.inf]
    return weighted_quantiles(angle[within], hope[within], SHARES)


def _camera(
    place: NDArray[np.float64],
    direction: NDArray[np.float64],
    hope: NDArray[np.float64],
    resolution: int,
) -> CachingCamera:
    """A camera that is aimed at the samples in `direction` (V, 3) and holds them if it can."""
    forward = hope @ direction
    forward /= np.linalg.norm(forward)
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    return CachingCamera(
        id=0,
        world_from_camera=look(place, forward, up),
        fov=field_of_view(_angles(direction, forward)),
        near=0.0,
        far=np.inf,
        resolution=resolution,
        kind="PERSPECTIVE",
        source=0,
    )


def _angles(direction: NDArray[np.float64], aim: NDArray[np.float64]) -> NDArray[np.float64]:
    """(V,) angles between unit directions (V, 3) and the unit `aim` (3,), radians."""
    return np.asarray(np.arccos(np.clip(direction @ aim, -1.0, 1.0)))
