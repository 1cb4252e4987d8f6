# SPDX-License-Identifier: GPL-3.0-or-later
"""Orthographic drawings of caching cameras in their scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from addon.camplace.camera import CachingCamera
from addon.camplace.placement import Placement
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View

from .place_colors import COARSE, CREASE, CUBE, EMPTY, MISSED, SINGLE, VIEW, WALL, WELL
from .scene_lines import section

# Lines drawn at most; the longest show best where things are.
MAX_LINES = 15_000
# Samples drawn at most in each plan, and maximal spheres that carry no camera, largest first.
MAX_SAMPLES = 6_000
MAX_SPHERES = 40
# A dot of the mean weight, and what dots may be, in square points: what weighs more is larger.
SAMPLE_SIZE = 6.0
SAMPLE_SIZES = (1.2, 16.0)
TINY = float(np.finfo(np.float64).tiny)
# A drawn frustum's length as a share of the box's diagonal, of a caching camera and of a view.
FRUSTUM = 0.07
VIEW_FRUSTUM = 0.1
# How far a plan reaches past what is of interest, as a share of its diagonal; and how far cameras
# outside of the box may stretch it.
BORDER = 0.03
STRETCH = 0.35
# Of the samples that views look at, those between these shares are common.
COMMON = (0.05, 0.95)
# A scale bar's length is at most this share of a plan's width.
SCALE_BAR = 0.25

# Drawn one over the other in this order.
_CREASES, _SECTION, _SPHERES, _SAMPLES, _MISSED, _CAMERAS, _NAMES = range(1, 8)


@dataclass(frozen=True)
class Plan:
    """An orthographic drawing: which world axes go right and up (or down), and its name."""

    right: int
    up: int
    title: str
    down: bool = False

    @property
    def across(self) -> list[int]:
        """The axes of the paper."""
        return [self.right, self.up]

    @property
    def depth(self) -> int:
        """The axis that is looked along."""
        return 3 - self.right - self.up


def plans_of(size: NDArray[np.float64]) -> tuple[Plan, Plan]:
    """The two drawings of a box of this size (3,), its longer horizontal side to the right."""
    if size[0] >= size[1]:
        return Plan(0, 1, "from above"), Plan(0, 2, "from the front")
    return Plan(1, 0, "from above", down=True), Plan(1, 2, "from the right")


def plan_limits(plan: Plan, placement: Placement, views: Sequence[View]) -> NDArray[np.float64]:
    """(2, 2) what a plan shows: the box of interest, and cameras near it."""
    diagonal = float(np.linalg.norm(placement.box[1] - placement.box[0]))
    origins = [c.origin for c in placement.cameras] + [v.origin for v in views if v.perspective]
    points = np.array([*placement.box, *origins])[:, plan.across]
    box = placement.box[:, plan.across]
    reach = STRETCH * diagonal
    points = np.clip(points, box[0] - reach, box[1] + reach)
    border = BORDER * diagonal
    return np.stack([points.min(axis=0) - border, points.max(axis=0) + border])


def draw_plan(
    axes: Axes,
    plan: Plan,
    limits: NDArray[np.float64],
    lines: NDArray[np.float64],
    what: tuple[SceneGeometry, Placement, Sequence[View]],
) -> None:
    """Draw one plan.

    Args:
        axes: where.
        plan: which.
        limits: (2, 2), `plan_limits`.
        lines: (L, 2, 3) the scene's sharp edges.
        what: the scene, its cameras and the views.
    """
    geometry, placement, views = what
    cut = _cut_height(plan, placement)
    _draw_lines(axes, lines[..., plan.across], limits, color=CREASE, width=0.4, order=_CREASES)
    walls = section(geometry, plan.depth, cut)[..., plan.across]
    _draw_lines(axes, walls, limits, color=WALL, width=0.9, order=_SECTION)
    box = placement.box[:, plan.across]
    size = box[1] - box[0]
    axes.add_patch(
        Rectangle((box[0, 0], box[0, 1]), size[0], size[1], fill=False, ls=(0, (5, 4)), ec="0.5")
    )
    _draw_samples(axes, plan, placement)
    _draw_spheres(axes, plan, placement)
    diagonal = float(np.linalg.norm(placement.box[1] - placement.box[0]))
    _draw_cameras(axes, plan, placement.cameras, FRUSTUM * diagonal)
    for view in views:
        corners = _view_corners(view, VIEW_FRUSTUM * diagonal)[:, plan.across]
        _draw_frustum(axes, corners, VIEW, alpha=0.13)
    axes.set_xlim(*limits[:, 0])
    axes.set_ylim(*(limits[::-1, 1] if plan.down else limits[:, 1]))
    axes.set_aspect("equal")
    names = "XYZ"
    axes.set_title(
        f"{plan.title.capitalize()}; dark lines: the section at {names[plan.depth]} = {cut:.3g} m",
        fontsize=11,
    )
    axes.set_xlabel(f"{names[plan.right]}, m", fontsize=9, color="0.3")
    axes.set_ylabel(f"{names[plan.up]}, m", fontsize=9, color="0.3")
    axes.tick_params(labelsize=8, colors="0.4")
    _draw_scale_bar(axes, limits, plan.down)


def _cut_height(plan: Plan, placement: Placement) -> float:
    """Where the section goes: through the middle of what is looked at, but for what is rare."""
    looked_at = placement.from_view if placement.from_view.any() else ~placement.from_view
    along = placement.sample_point[looked_at, plan.depth]
    return float(np.quantile(along, COMMON).mean())


def _draw_lines(
    axes: Axes,
    lines: NDArray[np.float64],
    limits: NDArray[np.float64],
    *,
    color: str,
    width: float,
    order: int,
) -> None:
    """(L, 2, 2) those that reach into the plan; at most MAX_LINES, the longest."""
    near = (lines.max(axis=1) >= limits[0]) & (lines.min(axis=1) <= limits[1])
    lines = lines[near.all(axis=1)]
    if len(lines) > MAX_LINES:
        length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)
        lines = lines[np.argpartition(length, -MAX_LINES)[-MAX_LINES:]]
    axes.add_collection(LineCollection(list(lines), colors=color, linewidths=width, zorder=order))


def _draw_samples(axes: Axes, plan: Plan, placement: Placement) -> None:
    some = np.arange(len(placement.sample_point))
    if len(some) > MAX_SAMPLES:
        some = np.random.default_rng(0).choice(some, MAX_SAMPLES, replace=False)
    point, worth = placement.sample_point[some][:, plan.across], placement.worth[some]
    weight = placement.sample_weight[some]
    size = np.clip(SAMPLE_SIZE * weight / max(float(weight.mean()), TINY), *SAMPLE_SIZES)
    well = placement.well_covered[some]
    for chosen, color, order in (
        ((worth > 0.0) & ~well, COARSE, _SAMPLES),
        (well, WELL, _SAMPLES),
        (worth == 0.0, MISSED, _MISSED),
    ):
        x, y = point[chosen].T
        axes.scatter(x, y, s=size[chosen], c=color, lw=0.0, alpha=0.75, zorder=order)


def _draw_spheres(axes: Axes, plan: Plan, placement: Placement) -> None:
    """Those that carry a camera, and the largest of the others."""
    used = {c.source for c in placement.cameras if c.kind == "CUBE_FACE"}
    order = np.argsort(-placement.spheres.radius)[:MAX_SPHERES]
    for index in {*order.tolist(), *used}:
        x, y = placement.spheres.centre[index, plan.across].tolist()
        strong = index in used
        axes.add_patch(
            Circle((x, y), float(placement.spheres.radius[index]), fill=False,
                   ec=CUBE if strong else EMPTY, lw=1.8 if strong else 0.5,
                   zorder=_CAMERAS if strong else _SPHERES)
        )  # fmt: skip


def _draw_cameras(axes: Axes, plan: Plan, cameras: Sequence[CachingCamera], length: float) -> None:
    cubes: dict[int, list[int]] = {}
    for camera in cameras:
        if camera.kind == "CUBE_FACE":
            cubes.setdefault(camera.source, []).append(camera.id)
            if len(cubes[camera.source]) == 1:
                axes.plot(*camera.origin[plan.across], "s", color=CUBE, ms=9, mec="w",
                          zorder=_CAMERAS)  # fmt: skip
        else:
            corners = _camera_corners(camera, length)[:, plan.across]
            _draw_frustum(axes, corners, SINGLE)
            axes.plot(*camera.origin[plan.across], "o", color=SINGLE, ms=5, mec="w",
                      zorder=_CAMERAS)  # fmt: skip
            _name(axes, camera.origin[plan.across], str(camera.id), SINGLE)
    for camera in cameras:
        faces = cubes.pop(camera.source, None) if camera.kind == "CUBE_FACE" else None
        if faces is not None:
            text = f"{faces[0]}–{faces[-1]}" if len(faces) > 1 else str(faces[0])  # noqa: RUF001
            _name(axes, camera.origin[plan.across], text, CUBE)


def _name(axes: Axes, place: NDArray[np.float64], text: str, color: str) -> None:
    axes.annotate(
        text, (float(place[0]), float(place[1])), color="w", fontsize=9, weight="bold",
        xytext=(7, 6), textcoords="offset points", clip_on=True, zorder=_NAMES,
        bbox={"boxstyle": "round,pad=0.18", "fc": color, "ec": "w", "lw": 0.6, "alpha": 0.9},
        annotation_clip=True,
    )  # fmt: skip


def _draw_frustum(
    axes: Axes, corners: NDArray[np.float64], color: str, alpha: float = 0.28
) -> None:
    """The outline (of the pyramid's shadow on the paper) and its four sides; apex first."""
    try:
        outline = corners[ConvexHull(corners).vertices]
    except QhullError:  # it is looked at exactly along one of its sides
        outline = corners
    axes.add_collection(
        PatchCollection(
            [Polygon(outline)], facecolors=color, edgecolors=color, alpha=alpha, zorder=_CAMERAS
        )
    )
    sides = [(corners[0], corner) for corner in corners[1:]]
    axes.add_collection(LineCollection(sides, colors=color, linewidths=0.9, zorder=_CAMERAS))


def _camera_corners(camera: CachingCamera, length: float) -> NDArray[np.float64]:
    """(5, 3) apex and corners of its pyramid, whose sides are as long as `length`."""
    depth = length / np.sqrt(1.0 + 2.0 * camera.half_extent**2)
    uv = np.array([[u, v, depth] for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=np.float64)
    return np.concatenate([camera.origin[None], camera.unproject(uv)])


def _view_corners(view: View, length: float) -> NDArray[np.float64]:
    """(5, 3) eye and corners of what a view sees; a parallel view's eye is amid its picture."""
    xy = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * [view.width, view.height]
    origin, direction = view.rays(xy.astype(np.float64))
    eye = origin.mean(axis=0)
    return np.concatenate([eye[None], origin + length * direction])


def _draw_scale_bar(axes: Axes, limits: NDArray[np.float64], down: bool) -> None:
    """In the lower left corner, a round number of metres long."""
    width, height = limits[1] - limits[0]
    longest = SCALE_BAR * float(width)
    power = 10.0 ** np.floor(np.log10(longest))
    length = max(step for step in (1.0, 2.0, 5.0) if step * power <= longest) * power
    x = float(limits[0, 0] + 0.02 * width)
    y = float(limits[1, 1] - 0.035 * height if down else limits[0, 1] + 0.035 * height)
    for color, thick in (("w", 7.0), ("k", 4.0)):
        axes.plot([x, x + length], [y, y], color=color, lw=thick, solid_capstyle="butt",
                  zorder=_NAMES)  # fmt: skip
    axes.annotate(
        _metres(float(length)), (float(x + 0.5 * length), float(y)), xytext=(0, 5),
        textcoords="offset points", ha="center", fontsize=9, weight="bold", zorder=_NAMES,
        bbox={"boxstyle": "round,pad=0.1", "fc": "w", "ec": "none", "alpha": 0.8},
    )  # fmt: skip


def _metres(length: float) -> str:
    """A length as one says it."""
    for unit, size in (("km", 1e3), ("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)):
        if length >= 0.999 * size:
            return f"{length / size:g} {unit}"
    return f"{length:g} m"
