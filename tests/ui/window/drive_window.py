# SPDX-License-Identifier: GPL-3.0-or-later
"""Drives a real Blender window like an artist would, and takes pictures of the screen.

Run by Blender itself (`window_check` starts it):

    blender --window-geometry 0 0 1600 1000 --python drive_window.py -- REQUEST.json

The steps are a generator that yields the seconds to wait, because Blender draws only between
timer calls. Writes to the request's `out` folder: before.png, after.png and ui.png (the whole
screen), view.blend (the scene with a camera where the viewport was) and window.json.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import bpy

CAMERA = "Viewport Check"
# Blender's viewport behaves like a camera with a sensor this wide, in millimetres.
VIEWPORT_SENSOR_MM = 72.0


def run(request: dict[str, Any]) -> Iterator[float]:
    """The whole check; yields seconds to wait before the next step."""
    out = Path(request["out"])
    report: dict[str, Any] = {"version": bpy.app.version_string, "python": sys.version}
    install(request, report)
    bpy.ops.wm.open_mainfile(filepath=request["blend"], load_ui=False)
    yield 1.0

    import gpu

    report["backend"] = gpu.platform.backend_type_get()
    report["renderer"] = gpu.platform.renderer_get()
    scene = bpy.context.scene
    scene.render.engine = "RELUME"
    scene.relume.cache_folder = request["cache"]
    scene.relume.viewport_samples = request["samples"]
    # Blender adds a pattern of up to half a step of the display; it differs between the two.
    scene.render.dither_intensity = 0.0
    unfinished = watch_drawing()
    area, region = view_3d()
    view = area.spaces.active
    view.shading.type = "RENDERED"
    for name in ("show_region_toolbar", "show_region_ui", "show_gizmo"):
        setattr(view, name, False)
    view.overlay.show_overlays = False
    look_through_camera(view, scene)
    yield 1.0

    add_equal_camera(view, region, scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(out / "view.blend"), copy=True)
    report["region"] = [region.x, region.y, region.width, region.height]
    window = bpy.context.window
    report["window"] = [window.x, window.y, window.width, window.height]

    report["before_s"] = yield from wait_and_grab(
        area, unfinished, out / "before.png", request["patience_s"]
    )
    for name, attributes in request["edits"].items():
        apply_edit(scene.objects[name], attributes)
    report["after_s"] = yield from wait_and_grab(
        area, unfinished, out / "after.png", request["patience_s"]
    )

    view.overlay.show_overlays = True
    properties = next(a for a in bpy.context.screen.areas if a.type == "PROPERTIES")
    properties.spaces.active.context = "RENDER"
    yield from wait_and_grab(area, unfinished, out / "ui.png", request["patience_s"])
    (out / "window.json").write_text(json.dumps(report, indent=2), encoding="utf-8")


def install(request: dict[str, Any], report: dict[str, Any]) -> None:
    """Install the extension, and have nothing lie over the viewport."""
    if request["zip"]:
        started = time.perf_counter()
        bpy.ops.extensions.package_install_files(
            filepath=request["zip"], repo="user_default", enable_on_install=True
        )
        report["install_s"] = time.perf_counter() - started
    bpy.context.preferences.system.use_region_overlap = False
    bpy.context.preferences.view.show_splash = False


def view_3d() -> tuple[Any, Any]:
    """The largest 3D viewport and its drawing region."""
    areas = [a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D"]
    area = max(areas, key=lambda a: a.width * a.height)
    return area, next(r for r in area.regions if r.type == "WINDOW")


def look_through_camera(view: Any, scene: Any) -> None:
    """Put the viewport's own eye where the scene's camera is."""
    region = view.region_3d
    region.view_perspective = "PERSP"
    view.lens = scene.camera.data.lens
    view.clip_start = scene.camera.data.clip_start
    view.clip_end = scene.camera.data.clip_end
    region.view_distance = 5.0
    region.view_matrix = scene.camera.matrix_world.normalized().inverted()


def add_equal_camera(view: Any, region: Any, scene: Any) -> None:
    """Add a camera that sees what the viewport sees, at the region's size."""
    data = bpy.data.cameras.new(CAMERA)
    data.sensor_fit = "AUTO"
    data.sensor_width = VIEWPORT_SENSOR_MM
    data.lens = view.lens
    data.clip_start, data.clip_end = view.clip_start, view.clip_end
    camera = bpy.data.objects.new(CAMERA, data)
    camera.matrix_world = view.region_3d.view_matrix.inverted()
    scene.collection.objects.link(camera)
    scene.render.resolution_x, scene.render.resolution_y = region.width, region.height
    scene.render.resolution_percentage = 100
    scene.render.pixel_aspect_x = scene.render.pixel_aspect_y = 1.0
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    seen = camera.calc_matrix_camera(graph, x=region.width, y=region.height)
    for row, wanted in zip(seen, view.region_3d.window_matrix, strict=True):
        for value, other in zip(row, wanted, strict=True):
            # Both are computed in float32, whose spacing near 1 is 1.2e-7.
            if abs(value - other) > 1e-5 * max(1.0, abs(other)):
                raise RuntimeError(f"the camera differs from the viewport:\n{seen}\n{wanted}")


def apply_edit(obj: Any, attributes: dict[str, Any]) -> None:
    """Set attributes of a light object, or of its light."""
    for name, value in attributes.items():
        # Objects have a `color` too, which only tints the solid display.
        setattr(obj.data if hasattr(obj.data, name) else obj, name, value)


def watch_drawing() -> list[bool]:
    """A list that is given, at every drawing of a Relume viewport, whether it has more to do."""
    module = next(m for name, m in sys.modules.items() if name.endswith(".relume.ui.viewport"))
    draw = module.Viewport.draw
    unfinished: list[bool] = []

    def watched(*args: Any) -> bool:
        unfinished.append(draw(*args))
        return unfinished[-1]

    module.Viewport.draw = watched
    return unfinished


def wait_and_grab(
    area: Any, unfinished: list[bool], path: Path, patience_s: float
) -> Generator[float, None, float]:
    """Grab the screen once the viewport is finished; returns the seconds that it took.

    The screen cannot tell by itself: samples that change nothing look like the end.
    """
    started = time.perf_counter()
    unfinished.clear()
    area.tag_redraw()
    while not unfinished or unfinished[-1]:
        yield 0.5
        if time.perf_counter() - started > patience_s:
            raise TimeoutError(f"the viewport was not finished within {patience_s} s: {path}")
    seconds = time.perf_counter() - started
    yield 1.0  # the last drawing has reached the screen
    subprocess.run(["import", "-window", "root", str(path)], check=True)
    return seconds


def drive(run: Callable[[dict[str, Any]], Iterator[float]]) -> None:
    """Step through run(), and quit Blender at its end; a failure leaves failed.txt."""
    request = json.loads(Path(sys.argv[sys.argv.index("--") + 1]).read_text(encoding="utf-8"))
    steps = run(request)

    def advance() -> float | None:
        try:
            return next(steps)
        except StopIteration:
            pass
        except BaseException:  # noqa: BLE001 - Blender must end, whatever went wrong
            text = traceback.format_exc()
            (Path(request["out"]) / "failed.txt").write_text(text, encoding="utf-8")
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(advance, first_interval=1.0, persistent=True)


if __name__ == "__main__":
    drive(run)
