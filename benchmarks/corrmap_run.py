# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of `benchmarks.corrmap` that run as processes of their own.

Each prints one line of JSON.

    python -m benchmarks.corrmap_run cameras SCENE.blend COUNT RESOLUTION CAMERAS.json
    python -m benchmarks.corrmap_run moves SCENE.blend CACHE WxH RUNS CAMERAS
    python -m benchmarks.corrmap_run cycles SCENE.blend WxH RUNS
    python -m benchmarks.corrmap_run eevee SCENE.blend WxH RUNS
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from addon.caching.store import CacheStore
    from addon.relight.session import RelightSession
    from addon.scene.view import View

# How far the camera goes from one picture to the next, metres along its x and y.
STEP = (0.05, 0.02)


def cameras(scene_path: str, count: str, resolution: str, out: str) -> dict[str, Any]:
    """Spread caching cameras over what the scene's camera sees."""
    from addon.camplace.cameras_file import write_cameras
    from tools.relit import read_scene, read_views

    from .spread_cameras import spread_cameras

    opened = _open(scene_path)
    (view,) = read_views(opened, [None])
    spread = spread_cameras(read_scene(opened).geometry, view, int(count), int(resolution))
    write_cameras(Path(out), spread)
    return {"cameras": len(spread)}


def moves(scene_path: str, cache: str, size: str, runs: str, count: str) -> dict[str, Any]:
    """Median seconds from a camera move to the first full picture, in a running session.

    The first so many of the cache's cameras are used; 0 stands for all of them. The same moves
    are made again with a wait after each pass, which tells what each of them takes.
    """
    opened = _open(scene_path)

    from addon.relight.layers.fence import Fence
    from addon.relight.session import RelightSession
    from addon.relight.shadows.shadow_frustum import ShadowSettings
    from tools.cache_check import check_cache
    from tools.gpu_context import open_gpu
    from tools.relit import read_scene, read_views

    arrays = read_scene(opened)
    store = first_cameras(check_cache(arrays.geometry, Path(cache), arrays.frame), int(count))
    open_gpu()
    started = time.perf_counter()
    session = RelightSession(arrays.geometry, store, 16, ShadowSettings(method="auto"))
    session.set_lights(arrays.lights)
    session.set_world(arrays.world)
    loaded = time.perf_counter() - started
    (view,) = read_views(opened, [None], _size(size))
    fence = Fence()

    def move(number: int) -> None:
        session.set_view(moved(view, number))
        while session.shown_stride != 1:
            session.step()
        fence.wait(session.draw_combined())

    whole = _median(move, range(int(runs) + 2))
    with timed_passes(fence) as seconds:
        _median(move, range(int(runs) + 2, 2 * int(runs) + 4))
    return {
        "triangles": len(arrays.geometry),
        "cameras": len(store.cameras),
        "load_s": loaded,
        "move_s": whole,
        "passes_s": {name: float(np.median(times[2:])) for name, times in seconds.items()},
        "cache_bytes": session.cache_bytes,
        **_coverage(session),
    }


def first_cameras(store: CacheStore, count: int) -> CacheStore:
    """A cache as if it had only the first so many of its cameras; all for 0."""
    from addon.caching.store import CacheStore

    if not count:
        return store
    kept = store.manifest.cameras[:count]
    finished = {camera.id: store.manifest.finished[camera.id] for camera in kept}
    return CacheStore(store.folder, replace(store.manifest, cameras=kept, finished=finished))


def moved(view: View, number: int) -> View:
    """The view of a camera so many steps away: to and fro, so that it stays where it is."""
    share = np.sin(1.7 * number)
    world_from_camera = view.world_from_camera.copy()
    x, y = STEP
    world_from_camera[:3, 3] += world_from_camera[:3, :2] @ (x * share, y * number % 0.1)
    return replace(view, world_from_camera=world_from_camera)


@contextmanager
def timed_passes(fence: Any) -> Iterator[dict[str, list[float]]]:
    """Gives the seconds of each pass between a move and the first full picture, one for each
    move; what is drawn more than once for a picture, as lights are, is added up."""
    from addon.corrmap.correspondence import CorrespondencePass, GatherPass
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.relight.layers.layer_drawing import LayerDrawing

    seconds: dict[str, list[float]] = {}
    inside = [0.0]

    def wrapped(name: str, draw: Callable[..., Any], drawn: Callable[..., Any]) -> Any:
        def timed(self: Any, *args: Any, **options: Any) -> Any:
            before, started = inside[0], time.perf_counter()
            result = draw(self, *args, **options)
            if name == "visible surface" and result is None:
                # Left to the rasterizer.
                return None
            fence.wait(drawn(result, *args))
            took = time.perf_counter() - started
            # What it caused to be drawn has its own time.
            own = took - (inside[0] - before)
            inside[0] = before + took
            if name == "visible surface":
                for times in seconds.values():
                    times.append(0.0)
            seconds.setdefault(name, [0.0])[-1] += own
            return result

        return timed

    passes: list[tuple[type, str, str, Callable[..., Any]]] = [
        (VisibleSurfacePass, "draw", "visible surface", lambda result, *_: result.position),
        (VisibleSurfacePass, "draw_traced", "visible surface", lambda result, *_: result.position),
        (CorrespondencePass, "draw", "correspondence", lambda result, *_: result.texture),
        (GatherPass, "draw", "gather", lambda result, *_: result.geometric_normal),
        (LayerDrawing, "light", "lights", lambda _, _light, layer, *__: layer.textures[0]),
        (LayerDrawing, "world", "world", lambda _, _world, _view, layer, *__: layer.textures[0]),
    ]
    kept = [(owner, method, getattr(owner, method)) for owner, method, _, _ in passes]
    try:
        for owner, method, name, drawn in passes:
            setattr(owner, method, wrapped(name, getattr(owner, method), drawn))
        yield seconds
    finally:
        for owner, method, value in kept:
            setattr(owner, method, value)


def _coverage(session: RelightSession) -> dict[str, float]:
    coverage = session.coverage
    return {"hole_fraction": coverage.hole_fraction, "open_fraction": coverage.open_fraction}


def cycles(scene_path: str, size: str, runs: str) -> dict[str, Any]:
    """Seconds from a camera move to Cycles' first sample, direct light only, with what it keeps
    between renders."""
    opened = _prepared(scene_path, size)
    opened.render.use_persistent_data = True
    opened.cycles.samples = 1
    return {"seconds": _render_moves(opened, int(runs))}


def eevee(scene_path: str, size: str, runs: str) -> dict[str, Any]:
    """Seconds from a camera move to EEVEE's first sample, with its shadows."""
    opened = _prepared(scene_path, size)
    opened.render.engine = "BLENDER_EEVEE"
    opened.eevee.use_raytracing = False
    opened.eevee.taa_render_samples = 1
    return {"seconds": _render_moves(opened, int(runs))}


def _render_moves(opened: Any, runs: int) -> float:
    import bpy

    at = opened.camera.location.copy()
    opened.render.filepath = ""

    def move(number: int) -> None:
        opened.camera.location.x = at.x + STEP[0] * np.sin(1.7 * number)
        bpy.ops.render.render()

    # The first render compiles shaders, and builds what is kept.
    return _median(move, range(runs + 1), skipped=1)


def _open(scene_path: str) -> Any:
    from tools.scene_file import load_blender, open_scene

    load_blender()
    return open_scene(Path(scene_path))


def _prepared(scene_path: str, size: str) -> Any:
    """The scene for direct light only."""
    from tools import reference

    opened = _open(scene_path)
    reference.prepare(opened)
    opened.render.resolution_x, opened.render.resolution_y = _size(size)
    opened.render.resolution_percentage = 100
    opened.cycles.use_adaptive_sampling = False
    return opened


def _size(size: str) -> tuple[int, int]:
    width, height = map(int, size.split("x"))
    return width, height


def _median(act: Callable[[int], None], numbers: Sequence[int], skipped: int = 2) -> float:
    """Median seconds; the first times, when shaders compile, do not count."""
    times = []
    for number in numbers:
        started = time.perf_counter()
        act(number)
        times.append(time.perf_counter() - started)
    return float(np.median(times[skipped:]))


STEPS = {step.__name__: step for step in (cameras, moves, cycles, eevee)}


def main() -> None:
    """Run one step."""
    name, *words = sys.argv[1:]
    print(json.dumps(STEPS[name](*words)))  # type: ignore[operator]


if __name__ == "__main__":
    main()
