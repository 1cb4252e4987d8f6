# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws caching cameras in their scene: from above, from the side, and what each one adds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from addon.camplace.placement import Placement
from addon.errors import InputError
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View
from addon.whole_file import replacing

from .place_figures import draw_curve, draw_figures, draw_legend
from .place_plan import draw_plan, plan_limits, plans_of
from .scene_lines import creases


def draw_placement(
    geometry: SceneGeometry, placement: Placement, path: Path, views: Sequence[View] = ()
) -> None:
    """Write the picture to `path`; its suffix says the format.

    Args:
        geometry: the scene.
        placement: the cameras and what was decided on.
        path: the file.
        views: what the cameras were placed for; drawn too.

    Raises:
        InputError: if it cannot be written there.
    """
    figure = Figure(figsize=(17.0, 11.0), layout="constrained")
    kind = path.suffix.removeprefix(".") or "png"
    if kind not in figure.canvas.get_supported_filetypes():
        raise InputError(f"{path} cannot be written: there are no .{kind} pictures; use .png")
    plans = plans_of(placement.box[1] - placement.box[0])
    limits = [plan_limits(plan, placement, views) for plan in plans]
    heights = [float(limit[1, 1] - limit[0, 1]) for limit in limits]
    grid = figure.add_gridspec(1, 2, width_ratios=(2.0, 1.0))
    # Neither plan so low that it cannot be read.
    lowest = 0.3 * max(heights)
    left = grid[0].subgridspec(2, 1, height_ratios=[max(h, lowest) for h in heights])
    lines = creases(geometry, placement.box)
    for row, (plan, limit) in enumerate(zip(plans, limits, strict=True)):
        draw_plan(figure.add_subplot(left[row]), plan, limit, lines, (geometry, placement, views))
    texts = grid[1].subgridspec(3, 1, height_ratios=(1.0, 0.5, 0.5))
    draw_curve(figure.add_subplot(texts[0]), placement)
    draw_legend(figure.add_subplot(texts[1]), placement, views)
    draw_figures(figure.add_subplot(texts[2]), placement)
    with mpl.rc_context({"savefig.dpi": 100}), replacing(path) as part:
        figure.savefig(part, format=kind)
