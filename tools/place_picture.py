# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws caching cameras in their scene: from above, from the side, and what each one adds."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from numpy.typing import NDArray

from addon.camplace.camera import CachingCamera
from addon.camplace.placement import Placement
from addon.errors import InputError
from addon.scene.geometry import SceneGeometry
from addon.whole_file import replacing

# Edges drawn at most; a random share of a heavy mesh still shows where things are.
MAX_EDGES = 40_000
# A drawn frustum's length as a share of the box's diagonal.
FRUSTUM = 0.09
# How far the picture reaches past the box of interest, as a share of its diagonal.
BORDER = 0.04
COLOR = {"CUBE_FACE": "tab:blue", "PERSPECTIVE": "tab:purple"}


def draw_placement(geometry: SceneGeometry, placement: Placement, path: Path) -> None:
    """Write the picture to `path`; its suffix says the format.

    Samples are green where a camera covers them (darker where it does so sharply) and red where
    none does; spheres that carry a primary camera are blue, other maximal spheres grey.

    Raises:
        InputError: if it cannot be written there.
    """
    figure = Figure(figsize=(16.0, 11.0), layout="constrained")
    plans = figure.subplots(2, 2, gridspec_kw={"width_ratios": (1.25, 1.0)})
    edges = _edges(geometry, placement)
    _draw_plan(plans[0, 0], edges, placement, (0, 1), "from above")
    _draw_plan(plans[1, 0], edges, placement, (0, 2), "from the front")
    _draw_plan(plans[1, 1], edges, placement, (1, 2), "from the right")
    _draw_curve(plans[0, 1], placement)
    kind = path.suffix.removeprefix(".") or "png"
    if kind not in figure.canvas.get_supported_filetypes():
        raise InputError(f"{path} cannot be written: there are no .{kind} pictures; use .png")
    with mpl.rc_context({"savefig.dpi": 100}), replacing(path) as part:
        figure.savefig(part, format=kind)


def _draw_plan(
    axes: Axes,
    edges: NDArray[np.float64],
    placement: Placement,
    plane: tuple[int, int],
    title: str,
) -> None:
    """One orthographic drawing; `plane` names the world axes to the right and up."""
    across = list(plane)
    box = placement.box[:, across]
    axes.add_collection(LineCollection(list(edges[..., across]), colors="0.75", linewidths=0.3))
    size = box[1] - box[0]
    axes.add_patch(Rectangle((box[0, 0], box[0, 1]), size[0], size[1], fill=False, ls=":"))
    _draw_samples(axes, placement, across)
    used = {c.source for c in placement.cameras if c.kind == "CUBE_FACE"}
    for index, (centre, radius) in enumerate(
        zip(placement.spheres.centre[:, across], placement.spheres.radius, strict=True)
    ):
        strong = index in used
        color, width = ("tab:blue", 1.6) if strong else ("0.6", 0.4)
        place = (float(centre[0]), float(centre[1]))
        axes.add_patch(Circle(place, radius, fill=False, color=color, lw=width))
    _draw_cameras(axes, placement, across)
    border = BORDER * float(np.linalg.norm(placement.box[1] - placement.box[0]))
    axes.set_xlim(box[0, 0] - border, box[1, 0] + border)
    axes.set_ylim(box[0, 1] - border, box[1, 1] + border)
    axes.set_aspect("equal")
    axes.set_xlabel(f"{'XYZ'[plane[0]]}, m")
    axes.set_ylabel(f"{'XYZ'[plane[1]]}, m")
    axes.set_title(title)


def _draw_samples(axes: Axes, placement: Placement, across: list[int]) -> None:
    point = placement.sample_point[:, across]
    seen, missed = point[placement.covered], point[~placement.covered]
    quality = placement.quality[placement.covered]
    axes.scatter(seen[:, 0], seen[:, 1], s=1.5, c=quality, cmap="YlGn", vmin=-0.6, vmax=1.0)
    axes.scatter(missed[:, 0], missed[:, 1], s=2.5, c="red")


def _draw_cameras(axes: Axes, placement: Placement, across: list[int]) -> None:
    length = FRUSTUM * float(np.linalg.norm(placement.box[1] - placement.box[0]))
    for camera in placement.cameras:
        color = COLOR[camera.kind]
        lines = _frustum(camera, length)[..., across]
        axes.add_collection(LineCollection(list(lines), colors=color, linewidths=0.9))
        # Faces of one cube share their place: the first one's number stands for all.
        if camera.kind == "CUBE_FACE" and any(
            c.source == camera.source and c.id < camera.id and c.kind == camera.kind
            for c in placement.cameras
        ):
            continue
        place = camera.origin[across]
        axes.plot(*place, "o", color=color, ms=4)
        axes.annotate(str(camera.id), (place[0], place[1]), color=color, fontsize=11,
                      xytext=(4, 4), textcoords="offset points", clip_on=True)  # fmt: skip


def _draw_curve(axes: Axes, placement: Placement) -> None:
    """Coverage and sharpness against the number of cameras."""
    number = np.arange(1, len(placement.cameras) + 1)
    axes.plot(number, 100.0 * placement.coverage, "o-", label="covered, all samples")
    axes.plot(number, 100.0 * placement.sharpness, "s-", label="sharpness, all samples")
    axes.set_ylim(0.0, 102.0)
    axes.set_xlabel("caching cameras")
    axes.set_ylabel("% of the weight")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(loc="lower right")
    shown = placement.from_view if placement.from_view.any() else ~placement.from_view
    weight = placement.sample_weight[shown]
    total = max(float(weight.sum()), np.finfo(np.float64).tiny)
    covered = 100.0 * float(weight @ placement.covered[shown]) / total
    sharp = 100.0 * float(weight @ placement.quality[shown]) / total
    tiers = np.array([camera.resolution for camera in placement.cameras])
    counts = ", ".join(f"{int((tiers == tier).sum())} x {tier}²" for tier in np.unique(tiers))
    axes.set_title(
        f"{len(placement.cameras)} cameras ({counts})\n"
        f"seen by the views: {covered:.1f} % covered, {sharp:.1f} % sharp"
    )


def _edges(geometry: SceneGeometry, placement: Placement) -> NDArray[np.float64]:
    """(E, 2, 3) edges of triangles that reach into the box, at most MAX_EDGES of them."""
    corners = geometry.vertices[geometry.triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    inside = ((high >= placement.box[0]) & (low <= placement.box[1])).all(axis=-1)
    corners = corners[inside]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    if len(edges) > MAX_EDGES:
        edges = edges[np.random.default_rng(0).choice(len(edges), MAX_EDGES, replace=False)]
    return edges


def _frustum(camera: CachingCamera, length: float) -> NDArray[np.float64]:
    """(8, 2, 3) the edges of its pyramid, cut at `length` from the apex along its sides."""
    depth = length / np.sqrt(1.0 + 2.0 * camera.half_extent**2)
    corner = camera.unproject(
        np.array([[u, v, depth] for u, v in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=np.float64)
    )
    apex = np.broadcast_to(camera.origin, corner.shape)
    sides = np.stack([apex, corner], axis=1)
    rim = np.stack([corner, np.roll(corner, -1, axis=0)], axis=1)
    return np.concatenate([sides, rim])
