# SPDX-License-Identifier: GPL-3.0-or-later
"""What caching cameras see, as a curve, a key to the colours and figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from addon.camplace.placement import Placement
from addon.scene.view import View

from .place_colors import COARSE, CUBE, EMPTY, MISSED, SINGLE, VIEW, WELL

# Names of views longer than this give way to their number.
LONGEST_NAME = 14
# Why there are no more cameras.
STOPPED = {"budget": "the budget is used up", "gain": "none would add enough"}
# A curve of more cameras has no dots.
MOST_MARKED = 40


def draw_curve(axes: Axes, placement: Placement) -> None:
    """What is seen, and well seen, against the number of cameras."""
    count = len(placement.cameras)
    number = np.arange(0, count + 1)
    cubes = sum(camera.kind == "CUBE_FACE" for camera in placement.cameras)
    if cubes:
        axes.axvspan(0, cubes, color=CUBE, alpha=0.07, lw=0)
        axes.text(0.5 * cubes, 102.5, "cube", color=CUBE, ha="center", fontsize=9)
    covered = 100.0 * np.array([0.0, *placement.seen])
    well = 100.0 * np.array([0.0, *placement.well_seen])
    marker = "o" if count <= MOST_MARKED else ""
    axes.plot(number, covered, color=WELL, lw=2.2, label="seen", marker=marker, ms=4.0)
    axes.plot(number, well, color="0.35", lw=1.6, ls="--", label="well seen")
    for value, above in ((covered[-1], 6), (well[-1], -13)):
        axes.annotate(f"{value:.1f} %", (count, float(value)), xytext=(-4, above), ha="right",
                      textcoords="offset points", fontsize=9, weight="bold")  # fmt: skip
    axes.set_xlim(0, max(count, 1))
    axes.set_ylim(0.0, 108.0)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("pictures, in the order of choice")
    axes.set_ylabel("% of all samples' weight")
    axes.grid(visible=True, alpha=0.3)
    axes.legend(loc="best", fontsize=9)
    axes.set_title("What each camera adds", fontsize=11)


def draw_legend(axes: Axes, placement: Placement, views: Sequence[View]) -> None:
    """What the colours mean."""
    axes.axis("off")
    covered = placement.covered
    well = placement.well_covered

    def share(chosen: NDArray[np.bool_]) -> str:
        return _percent(float(placement.sample_weight[chosen].sum()))

    entries = [
        _dot(WELL, f"seen well: {share(well)}"),
        _dot(COARSE, f"seen coarsely: {share(covered & ~well)}"),
        _dot(MISSED, f"seen by no camera: {share(~covered)}"),
        Line2D([], [], ls="none", marker="s", ms=9, color=CUBE, label="primary: a cube of faces"),
        Line2D([], [], color=CUBE, lw=1.8, label="its empty sphere"),
        Patch(fc=SINGLE, ec=SINGLE, alpha=0.4, label="secondary: a single picture"),
        Line2D([], [], color=EMPTY, lw=1.0, label="other spheres"),
        Line2D([], [], color="0.5", ls=(0, (5, 4)), label="box of interest"),
    ]
    if views:
        named = ", ".join(dict.fromkeys(view.name for view in views if view.name))
        named = named if len(named) <= LONGEST_NAME else f"{len(views)} views"
        entries.insert(6, Patch(fc=VIEW, ec=VIEW, alpha=0.4, label=f"the shot: {named}"))
    axes.legend(
        handles=entries, loc="center left", fontsize=10, frameon=False, ncols=2,
        borderaxespad=0.0, columnspacing=1.2, alignment="left",
        title="Each dot is a sample of the surface, as large as its weight",
        title_fontproperties={"weight": "bold", "size": 10},
    )  # fmt: skip


def _dot(color: str, label: str) -> Line2D:
    return Line2D([], [], ls="none", marker="o", color=color, label=label)


def draw_figures(axes: Axes, placement: Placement) -> None:
    """The result in words."""
    axes.axis("off")
    cameras = placement.cameras
    cubes = [c for c in cameras if c.kind == "CUBE_FACE"]
    tiers = np.array([camera.resolution for camera in cameras])
    sizes = ", ".join(f"{int((tiers == t).sum())} of {t}²" for t in np.unique(tiers))
    shares, left = placement.shares, placement.left_out
    cube_count, single = len({c.source for c in cubes}), len(cameras) - len(cubes)
    view_seen, view_well = _percent(shares.view_seen), _percent(shares.view_well)
    area_seen, area_well = _percent(shares.area_seen), _percent(shares.area_well)
    unreachable = _percent(left.unreachable)
    over, little = _percent(left.over_budget), _percent(left.too_little)
    lines = [
        f"{len(cameras)} pictures ({sizes} texels)",
        f"Cubes: {cube_count}, of {len(cubes)} faces in all; single pictures: {single}",
        f"Of what the views see: {view_seen} seen, {view_well} well",
        f"Of the surface in the box: {area_seen} seen, {area_well} well",
        f"Seen by none, of all weight: {unreachable} out of every camera's reach,",
        f"    {over} over the budget, {little} not worth another camera",
        f"No more cameras: {STOPPED[placement.stop]}",
    ]
    if placement.kept:
        lines.insert(1, f"{placement.kept} kept from before")
    axes.text(0.0, 0.98, "\n".join(lines), transform=axes.transAxes, va="top", fontsize=10,
              linespacing=1.7, wrap=True)  # fmt: skip


def _percent(share: float) -> str:
    return "–" if np.isnan(share) else f"{100.0 * share:.1f} %"  # noqa: RUF001
