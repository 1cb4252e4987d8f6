# SPDX-License-Identifier: GPL-3.0-or-later
"""Orbits a real Blender window's view, and says what each drawing showed and how long it took.

Run by Blender itself (`move_check` starts it):

    blender --window-geometry 0 0 1600 1000 --python drive_move.py -- REQUEST.json

Writes to the request's `out` folder, for each frame rate: moving_RATE.png in the middle of the
orbit, still_RATE.png once the picture is finished, and all drawings to move.json.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import time
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from drive_window import (  # type: ignore[import-not-found]  # Blender runs this file by path
    drive,
    install,
    look_through_camera,
    view_3d,
    wait_and_grab,
    watch_drawing,
)

# Views of an orbit, and the degrees between them.
VIEWS, STEP = 40, 1.0


def run(request: dict[str, Any]) -> Iterator[float]:
    """The whole check; yields seconds to wait before the next step."""
    out = Path(request["out"])
    report: dict[str, Any] = {"rates": {}}
    install(request, report)
    bpy.ops.wm.open_mainfile(filepath=request["blend"], load_ui=False)
    yield 1.0

    scene = bpy.context.scene
    scene.render.engine = "RELUME"
    scene.relume.cache_folder = request["cache"]
    scene.relume.viewport_samples = request["samples"]
    unfinished = watch_drawing()
    drawings = note_drawings()
    area, region = view_3d()
    view = area.spaces.active
    view.shading.type = "RENDERED"
    view.show_gizmo = view.show_region_toolbar = view.show_region_ui = False
    look_through_camera(view, scene)
    report["size"] = [region.width, region.height]
    unfold(("RELUME_PT_performance", "RELUME_PT_frame"))
    properties = next(a for a in bpy.context.screen.areas if a.type == "PROPERTIES")
    properties.spaces.active.context = "RENDER"
    yield 1.0
    yield from wait_and_grab(area, unfinished, out / "start.png", request["patience_s"])
    for rate in request["rates"]:
        scene.relume.frame_rate = rate
        drawings.clear()
        yield from orbit(area, drawings, out / f"moving_{rate}.png")
        count = len(drawings)
        seconds = yield from wait_and_grab(
            area, unfinished, out / f"still_{rate}.png", request["patience_s"]
        )
        report["rates"][rate] = {
            "moving": drawings[:count], "after": drawings[count:], "still_s": seconds,
        }  # fmt: skip
    (out / "move.json").write_text(json.dumps(report, indent=1), encoding="utf-8")


def unfold(names: tuple[str, ...]) -> None:
    """Have panels open that are closed at first, and two others closed in their place."""
    for name in (*names, "RELUME_PT_cache", "RELUME_PT_sampling"):
        panel = getattr(bpy.types, name)
        bpy.utils.unregister_class(panel)
        panel.bl_options = set() if name in names else {"DEFAULT_CLOSED"}
        bpy.utils.register_class(panel)


def orbit(area: Any, drawings: list[dict[str, Any]], path: Path) -> Generator[float]:
    """Turn the view, each time it was drawn, and grab the screen half way round."""
    from mathutils import Quaternion

    region = area.spaces.active.region_3d
    turn = Quaternion((0.0, 0.0, 1.0), math.radians(STEP))
    for number in range(VIEWS):
        region.view_rotation = turn @ region.view_rotation
        drawn = len(drawings)
        area.tag_redraw()
        until = time.perf_counter() + 5.0
        while len(drawings) == drawn and time.perf_counter() < until:
            yield 0.001
        if number == VIEWS // 2:
            subprocess.run(["import", "-window", "root", str(path)], check=True)


def note_drawings() -> list[dict[str, Any]]:
    """A list that gets what each drawing of a Relume viewport showed."""
    module = next(
        m for name, m in sys.modules.items() if name.endswith(".relume.ui.progressive_picture")
    )
    refine = module.ProgressivePicture.refine
    drawings: list[dict[str, Any]] = []

    def noted(picture: Any, session: Any, *args: Any) -> bool:
        started = time.perf_counter()
        unfinished: bool = refine(picture, session, *args)
        drawings.append({
            "seconds": time.perf_counter() - started,
            "moving": picture.is_moving,
            "divisor": picture.divisor,
            "compiling": session.compiling,
            "first": picture.times.first,
            "full": picture.times.full,
            "last": picture.times.last,
        })  # fmt: skip
        return unfinished

    module.ProgressivePicture.refine = noted
    return drawings


if __name__ == "__main__":
    drive(run)
