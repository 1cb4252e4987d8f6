# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of `benchmarks.placement` that run as processes of their own.

Memory that one step has used does not count for the next then. Each prints one line of JSON.

    python -m benchmarks.placement_run extract SCENE.blend ARRAYS
    python -m benchmarks.placement_run hall ARRAYS
    python -m benchmarks.placement_run subdivide ARRAYS COUNT ARRAYS
    python -m benchmarks.placement_run place ARRAYS CORES [fresh] [view=NAME]
"""

from __future__ import annotations

import gc
import json
import os
import pickle
import re
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from addon.scene.geometry import SceneGeometry
from addon.scene.view import View

# The boxes of the hall stand on this many places along its sides.
ALONG, ACROSS = 30, 20


def extract(scene_path: str, out: str) -> dict[str, Any]:
    """Read the .blend file with Blender, as `relume place` does."""
    from tools.scene_file import load_blender, open_scene

    load_blender()
    with_blender = _memory("VmRSS")
    from addon.scene.shot_reader import read_shot
    from tools.relit import read_scene

    start = time.perf_counter()
    scene = open_scene(Path(scene_path))
    opened = time.perf_counter()
    geometry, views = read_scene(scene).geometry, read_shot(scene)
    read = time.perf_counter()
    _write(out, geometry, views)
    return {
        "triangles": len(geometry),
        "views": len(views),
        "active": scene.camera.name if scene.camera else "",
        "open_s": opened - start,
        "read_s": read - opened,
        "blender_mb": with_blender,
        "peak_mb": _memory("VmHWM"),
    }


def hall(out: str) -> dict[str, Any]:
    """A closed hall, 30 by 20 by 6 m, with 600 boxes of many sizes, seen from two corners."""
    from tests.synthetic import box, geometry_of, looking_at, perspective_view

    rng = np.random.default_rng(0)
    size = np.array([ALONG, ACROSS, 6.0])
    walls, triangles = box((0.5, 0.5, 0.5), 1.0)
    parts = [(walls * size, triangles)]
    for x in range(ALONG):
        for y in range(ACROSS):
            side = rng.uniform(0.1, 0.7, 3) * (1.0, 1.0, 3.0)
            corners = (walls - (0.5, 0.5, 0.0)) * side + (x + 0.5, y + 0.5, 0.0)
            parts.append((corners, triangles))
    views = (
        perspective_view(looking_at((0.5, 0.5, 3.0), (15.0, 10.0, 0.5)), 640, 480, 1.2),
        perspective_view(looking_at((29.5, 12.0, 2.5), (12.0, 10.0, 1.0)), 640, 480, 1.2),
    )
    geometry = geometry_of(parts)
    _write(out, geometry, views)
    return {"triangles": len(geometry)}


def subdivide(arrays: str, count: str, out: str) -> dict[str, Any]:
    """The same surface in `count` triangles."""
    from .subdivision import subdivided

    geometry, views = _read(arrays)
    geometry = subdivided(geometry, int(count))
    _write(out, geometry, views)
    return {"triangles": len(geometry)}


def place(arrays: str, cores: str, *options: str) -> dict[str, Any]:
    """Place cameras with the paper's budget; with `fresh`, also ask fresh samples; with
    `view=NAME`, for the views of that camera alone."""
    from addon.camplace.place import place_cameras
    from addon.camplace.settings import PlacementSettings

    geometry, views = _read(arrays)
    names = [option.removeprefix("view=") for option in options if option.startswith("view=")]
    views = tuple(view for view in views if not names or view.name in names)
    gc.collect()
    _forget_peak()
    before = _memory("VmRSS")
    marks: list[tuple[float, str]] = []

    def progress(_share: float, message: str) -> None:
        marks.append((time.perf_counter(), re.sub(r"\s*\d+.*", "", message)))

    start, cpu = time.perf_counter(), time.process_time()
    placement = place_cameras(
        geometry, views, PlacementSettings(primaries=1, secondaries=8), progress
    )
    end = time.perf_counter()
    marks.append((end, ""))
    steps: dict[str, float] = {}
    for (begun, message), (done, _) in pairwise(marks):
        steps[message] = steps.get(message, 0.0) + done - begun
    report = {
        "triangles": len(geometry),
        "cores": int(cores),
        "seconds": end - start,
        "cpu_s": time.process_time() - cpu,
        "steps": steps,
        "before_mb": before,
        "peak_mb": _memory("VmHWM"),
        "pictures": len(placement.cameras),
        "own": placement.report(),
    }
    if "fresh" in options:
        from tools.placement_measure import FreshSamples

        fresh = FreshSamples(geometry, views, placement.box).measure(placement.cameras)
        report["fresh"] = vars(fresh)
    return report


def _write(path: str, geometry: SceneGeometry, views: tuple[View, ...]) -> None:
    # replace() leaves out what the geometry has worked out and remembered.
    with Path(path).open("wb") as file:
        pickle.dump((replace(geometry), views), file, protocol=5)


def _read(path: str) -> tuple[SceneGeometry, tuple[View, ...]]:
    with Path(path).open("rb") as file:
        return pickle.load(file)


def _memory(field: str) -> float:
    """VmRSS (resident now) or VmHWM (most so far) of this process, in MiB (Linux)."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field):
            return int(line.split()[1]) / 1024.0
    return float("nan")


def _forget_peak() -> None:
    """Let VmHWM start from what is resident now (see proc(5), clear_refs)."""
    Path("/proc/self/clear_refs").write_text("5")


STEPS: dict[str, Callable[..., dict[str, Any]]] = {
    "extract": extract,
    "hall": hall,
    "subdivide": subdivide,
    "place": place,
}

if __name__ == "__main__":
    if sys.argv[1] == "place":
        # Before embree is loaded, which starts as many threads as there are cores for it.
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: int(sys.argv[3])])
    print(json.dumps(STEPS[sys.argv[1]](*sys.argv[2:])))
