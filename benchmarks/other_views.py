# SPDX-License-Identifier: GPL-3.0-or-later
"""Views of a scene that its caching cameras were not placed for, by one rule for all scenes.

Placement looks through the scene's cameras, and from up to a tenth of their viewing distance away
(`addon/camplace/moves.py`). The views here stand three to five tenths away from a camera (less
where there is no room), and turn to what it looks at, or beyond. Nothing is chosen by hand: a move
that ends in a wall, behind one, or right before a surface is halved, then mirrored, then left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from addon.camplace.frame import LocalFrame
from addon.camplace.rays import RayCaster
from addon.camplace.surface_distance import sphere_directions
from addon.errors import InputError
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View

# Moves to the right, up and forward, and how far ahead of its camera lies what the view then turns
# to: in viewing distances.
MOVES = (
    ((0.35, 0.10, 0.0), 1.0),
    ((-0.30, 0.0, 0.15), 2.0),
    ((0.10, -0.05, 0.45), 1.5),
    ((-0.25, 0.25, -0.20), 1.0),
)
# A blocked move is halved so often.
HALVINGS = 2
# Rays across and up a view, which tell what it sees; directions in which it has room.
GRID = (24, 18)
STAR = 64
# A view needs this share of its camera's room to the nearest surface, of the pixels that see any,
# and of its viewing distance.
LEAST_ROOM, LEAST_SEEN, LEAST_DISTANCE = 0.2, 0.6, 0.3


@dataclass(frozen=True)
class Sight:
    """What a view sees, in few rays.

    Attributes:
        distance: median of the distances to surfaces, of the rays that meet any; infinite for none.
        seen: share of the rays that meet any.
        room: distance to the nearest surface in any direction.
    """

    distance: float
    seen: float
    room: float


def other_views(views: Sequence[View], geometry: SceneGeometry, count: int = 4) -> list[View]:
    """Views that none of the given ones is, each named "Other 1", "Other 2", ...

    Args:
        views: the shot's; they take turns.
        geometry: the scene, metres and world space.
        count: how many.

    Raises:
        InputError: no view sees a surface, or there is no room for so many.
    """
    frame = LocalFrame.of(geometry, tuple(views), None)
    rays = RayCaster(frame.geometry_from_world(geometry))
    local = [frame.view_from_world(view) for view in views]
    sights = [sight_of(view, rays) for view in local]
    usable = [n for n, sight in enumerate(sights) if np.isfinite(sight.distance)]
    if not usable:
        raise InputError("no camera of the scene sees a surface; turn one to the set")
    found: list[View] = []
    # Every move from every camera, beginning with another camera for each move.
    for turn in range(len(usable)):
        for number in range(len(MOVES)):
            base = usable[(turn + number) % len(usable)]
            moved = _moved(local[base], sights[base], rays, *MOVES[number])
            if moved is not None and len(found) < count:
                world = views[base].world_from_camera.copy()
                world[:3, :3] = moved.world_from_camera[:3, :3]
                world[:3, 3] = frame.to_world(moved.origin)
                name = f"Other {len(found) + 1}"
                found.append(replace(views[base], world_from_camera=world, name=name))
    if len(found) < count:
        raise InputError(
            f"there is room for {len(found)} views beside the scene's cameras, not for {count}; "
            "add a camera"
        )
    return found


def sight_of(view: View, rays: RayCaster) -> Sight:
    """What a view of the local scene sees."""
    across, up = GRID
    x, y = np.meshgrid((np.arange(across) + 0.5) / across, (np.arange(up) + 0.5) / up)
    xy = np.stack([x * view.width, y * view.height], axis=-1).reshape(-1, 2)
    distance = rays.first_hit(*view.rays(xy)).distance
    met = np.isfinite(distance)
    star = sphere_directions(STAR)
    near = rays.first_hit(np.broadcast_to(view.origin, star.shape).copy(), star).distance
    median = float(np.median(distance[met])) if met.any() else np.inf
    return Sight(median, float(met.mean()), float(near.min()))


def _moved(
    view: View, sight: Sight, rays: RayCaster, move: tuple[float, float, float], ahead: float
) -> View | None:
    """The view moved as far as there is room for; None where there is none."""
    for mirror in (1.0, -1.0):
        for halving in range(HALVINGS + 1):
            right, up, forward = (part * 0.5**halving * sight.distance for part in move)
            moved = turned(view, (mirror * right, up, forward), ahead * sight.distance)
            if rays.occluded(moved.origin[None], view.origin[None]).any():
                continue
            found = sight_of(moved, rays)
            if (
                found.room >= min(LEAST_ROOM * sight.room, LEAST_ROOM * sight.distance)
                and found.seen >= LEAST_SEEN * sight.seen
                and found.distance >= LEAST_DISTANCE * sight.distance
            ):
                return moved
    return None


def turned(view: View, move: tuple[float, float, float], distance: float) -> View:
    """The view moved to the right, up and forward, looking at what it had straight ahead.

    Args:
        view: which.
        move: metres.
        distance: of what it turns to, metres.
    """
    axes = view.world_from_camera[:3, :3]
    place = view.origin + axes @ np.array([move[0], move[1], -move[2]])
    back = place - (view.origin - distance * axes[:, 2])
    back /= np.linalg.norm(back)
    right = np.cross(axes[:, 1], back)
    right /= np.linalg.norm(right)
    world: NDArray[np.float64] = np.eye(4)
    world[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    world[:3, 3] = place
    return replace(view, world_from_camera=world)
