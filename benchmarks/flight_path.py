# SPDX-License-Identifier: GPL-3.0-or-later
"""A smooth flight through a scene, by one rule for all scenes.

The way leads past the scene's own cameras and past views beside them (`other_views`), each camera
before the views that are nearest to it, from the nearest to the next nearest. Between two that do
not see each other it goes by places that are known to be free, the shortest way in lines of sight.
It is rounded where there is room, and flown at one speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation, Slerp

from addon.camplace.frame import LocalFrame
from addon.camplace.rays import RayCaster
from addon.errors import InputError
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View

# Points of the rounded way between two of its places.
ROUNDING = 16
# Of the way's length between places that do not move, so that a turn on the spot takes time too.
LEAST_STEP = 1e-3


@dataclass(frozen=True)
class Flight:
    """The views along the way.

    Attributes:
        views: one a frame; all have the first camera's lens.
        length: of the way, metres.
        left_out: names of views to which no line of sight led.
    """

    views: tuple[View, ...]
    length: float
    left_out: tuple[str, ...]


def fly(
    stops: Sequence[View], free: NDArray[np.float64], geometry: SceneGeometry, frames: int
) -> Flight:
    """Fly from the first of the views past the others.

    Args:
        stops: perspective views, metres and world space.
        free: (N, 3) places in free space, metres and world space.
        geometry: the scene.
        frames: of the flight.

    Raises:
        InputError: there are not two views that lines of sight join.
    """
    frame = LocalFrame.of(geometry, tuple(stops), None)
    rays = RayCaster(frame.geometry_from_world(geometry))
    places = np.array([frame.from_world(view.origin) for view in stops])
    nodes = np.concatenate([places, frame.from_world(free).reshape(-1, 3)])
    sees = _lines_of_sight(nodes, rays)
    order, way = _order(len(places), nodes, sees)
    if len(order) < 2:
        raise InputError("no line of sight joins two of the views; add a camera beside another")
    points, turns = _legs(order, way, nodes)
    rounded, at = _rounded(points, rays)
    # At one speed: by the way's length, from stop to stop.
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rounded, axis=0), axis=1))])
    length += LEAST_STEP * length[-1] * np.linspace(0.0, 1.0, len(length))
    when = np.linspace(0.0, length[-1], frames)
    place = np.stack([np.interp(when, length, rounded[:, axis]) for axis in range(3)], axis=1)
    matrices = np.array([stops[n].world_from_camera[:3, :3] for n in order])
    rotations: Any = Rotation.from_matrix(matrices)
    stop_length = length[at[turns]]
    # The turn from stop to stop, without a jerk at the stops.
    eased = PchipInterpolator(stop_length, np.arange(len(order)))(when)
    facing = Slerp(np.arange(len(order)), rotations)(np.clip(eased, 0.0, len(order) - 1))
    views = []
    for number in range(frames):
        world = np.eye(4)
        world[:3, :3] = facing[number].as_matrix()
        world[:3, 3] = frame.to_world(place[number])
        views.append(replace(stops[order[0]], world_from_camera=world, name=f"frame {number}"))
    visited = set(order)
    left_out = tuple(view.name for n, view in enumerate(stops) if n not in visited)
    return Flight(tuple(views), float(length[-1]) * frame.unit, left_out)


def _lines_of_sight(nodes: NDArray[np.float64], rays: RayCaster) -> NDArray[np.bool_]:
    """(N, N) which of the (N, 3) places see each other."""
    first, second = np.triu_indices(len(nodes), 1)
    clear = ~rays.occluded(nodes[first], nodes[second])
    sees = np.zeros((len(nodes), len(nodes)), dtype=np.bool_)
    sees[first, second] = sees[second, first] = clear
    return sees


def _order(
    count: int, nodes: NDArray[np.float64], sees: NDArray[np.bool_]
) -> tuple[list[int], list[list[int]]]:
    """The stops from nearest to next nearest, and the places on the way to each but the first."""
    order, ways, rest = [0], [], set(range(1, count))
    while rest:
        way = _shortest(order[-1], rest, nodes, sees)
        if not way:
            break
        ways.append(way)
        order.append(way[-1])
        rest.remove(way[-1])
    return order, ways


def _shortest(
    start: int, goals: set[int], nodes: NDArray[np.float64], sees: NDArray[np.bool_]
) -> list[int]:
    """The shortest way in lines of sight to the nearest of the goals (Dijkstra); [] for none."""
    front: list[tuple[float, int, tuple[int, ...]]] = [(0.0, start, (start,))]
    known: set[int] = set()
    while front:
        length, node, way = heappop(front)
        if node in goals:
            return list(way)
        if node in known:
            continue
        known.add(node)
        for other in np.flatnonzero(sees[node]):
            step = float(np.linalg.norm(nodes[other] - nodes[node]))
            heappush(front, (length + step, int(other), (*way, int(other))))
    return []


def _legs(
    order: list[int], ways: list[list[int]], nodes: NDArray[np.float64]
) -> tuple[NDArray[np.float64], list[int]]:
    """The way's places (M, 3), and which of them are stops."""
    points, turns = [order[0]], [0]
    for way in ways:
        points += way[1:]
        turns.append(len(points) - 1)
    return nodes[points], turns


def _rounded(
    points: NDArray[np.float64], rays: RayCaster
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The way through (M, 3) places as many short lines, and where in them the places are.

    Each leg is a Catmull-Rom spline, or the straight line where that meets a surface.
    """
    padded = np.concatenate([points[:1], points, points[-1:]])
    t = (np.arange(ROUNDING) / ROUNDING)[:, None]
    parts = []
    for a, b, c, d in zip(padded, padded[1:], padded[2:], padded[3:], strict=False):
        curve = 0.5 * (
            2.0 * b + (c - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d) * t**2
            + (3.0 * b - a - 3.0 * c + d) * t**3
        )  # fmt: skip
        ends = np.concatenate([curve[1:], c[None]])
        parts.append((b + (c - b) * t) if rays.occluded(curve, ends).any() else curve)
    at = ROUNDING * np.arange(len(points))
    return np.concatenate([*parts, points[-1:]]), at
