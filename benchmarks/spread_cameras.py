# SPDX-License-Identifier: GPL-3.0-or-later
"""As many caching cameras as one likes for one shot: each looks at something that its view sees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from addon.camplace.aim import look
from addon.camplace.camera import CachingCamera
from addon.camplace.rays import RayCaster
from addon.scene.frame_across import frame_across
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View

_FOV = 0.5 * np.pi

# Shares of what the view sees from afar at which a camera may stand off.
_NEAREST, _FARTHEST = 0.05, 0.5

# Drawn at once, of which those that something hides are left out.
_DRAWN = 4096


def spread_cameras(
    geometry: SceneGeometry, view: View, count: int, resolution: int, seed: int = 0
) -> tuple[CachingCamera, ...]:
    """Cameras around random places that a view sees. Fewer are the first of more.

    Half of what a place sees may be far away or behind it: these are not the best cameras, but
    many overlap wherever the view looks, which is what a search among them has to cope with.
    """
    random = np.random.default_rng(seed)
    caster = RayCaster(geometry)
    xy = random.random((_DRAWN, 2)) * (view.width, view.height)
    origins, directions = view.rays(xy)
    hits = caster.first_hit(origins, directions)
    met = hits.triangle >= 0
    places = origins[met] + hits.distance[met, None] * directions[met]
    normal = geometry.normal[hits.triangle[met]]
    normal *= -np.sign((normal * directions[met]).sum(axis=1))[:, None]
    away = random.normal(size=places.shape)
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    away *= np.sign((away * normal).sum(axis=1))[:, None]
    reach = np.median(hits.distance[met])
    off = reach * _NEAREST * (_FARTHEST / _NEAREST) ** random.random(len(places))
    eyes = places + off[:, None] * away
    # The way to the eye starts a little above the surface.
    free = ~caster.occluded(places + 1e-3 * off[:, None] * normal, eyes)
    chosen = np.flatnonzero(free)[:count]
    if len(chosen) < count:
        raise ValueError(f"the view sees places for {len(chosen)} cameras, not for {count}")
    return tuple(
        _camera(number, eyes[index], places[index], resolution)
        for number, index in enumerate(chosen)
    )


def _camera(
    number: int, eye: NDArray[np.float64], target: NDArray[np.float64], resolution: int
) -> CachingCamera:
    way = target - eye
    length = float(np.linalg.norm(way))
    world_from_camera = look(eye, way, frame_across(way / length)[0])
    return CachingCamera(
        number, world_from_camera, _FOV, 1e-3 * length, 1e3 * length, resolution, "PERSPECTIVE",
        number,
    )  # fmt: skip
