# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of `benchmarks.relight` that run as processes of their own.

Each prints one line of JSON.

    python -m benchmarks.relight_run scene TRIANGLES LIGHTS SCENE.blend
    python -m benchmarks.relight_run edits SCENE.blend CACHE WxH RUNS map|traced FOLDER
    python -m benchmarks.relight_run cycles SCENE.blend WxH SAMPLES,... FOLDER
    python -m benchmarks.relight_run truth SCENE.blend WxH SAMPLES FOLDER
    python -m benchmarks.relight_run eevee SCENE.blend WxH SAMPLES,...
    python -m benchmarks.relight_run errors FOLDER
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

# What every renderer is shown: the key light here, and a little brighter.
KEY_SHIFT = (0.6, -0.4, 0.3)
TRUTH = "truth.exr"


def scene(triangles: str, lights: str, out: str) -> dict[str, Any]:
    """Make the scene."""
    from .heads_scene import build

    return {"triangles": build(int(triangles), int(lights), Path(out))}


def edits(  # noqa: PLR0917 - the words of one command line
    scene_path: str, cache: str, size: str, runs: str, shadows: str, folder: str
) -> dict[str, Any]:
    """Median seconds from an edit of the key light to its picture, in a running session.

    The key light moves to and fro: its shadow and its layer are new every time, and the picture
    is read back in part so that the GPU has surely drawn it. Pictures of more and more samples
    at the place that the other renderers are shown are written to FOLDER.
    """
    from tools.picture_file import write_exr
    from tools.relit import open_session, read_scene, read_views

    opened = _open(scene_path)
    arrays = read_scene(opened)
    started = time.perf_counter()
    session = open_session(arrays, Path(cache), 16)
    loaded = time.perf_counter() - started
    (view,) = read_views(opened, [None], _size(size))
    session.set_view(view)
    lights = {light.name: light for light in arrays.lights}
    key = lights["Key"]

    def wait() -> None:
        texture = session.draw_combined()
        _finished(texture)

    def shown(shift: float) -> None:
        moved = key.world_from_light.copy()
        moved[:3, 3] += np.array(KEY_SHIFT) * shift
        lights["Key"] = replace(key, world_from_light=moved)
        session.set_lights([*lights.values()])

    def first_picture(shift: float) -> None:
        """One sample of the key light over what the others show."""
        shown(shift)
        session.step()
        wait()

    def recolored(factor: float) -> None:
        lights["Key"] = replace(lights["Key"], energy=key.energy * factor)
        session.set_lights([*lights.values()])
        wait()

    started = time.perf_counter()
    while session.samples_done < 1 and session.step():
        pass
    wait()
    first_view = time.perf_counter() - started
    # The others refine to the end; the edits are timed against a still picture.
    while session.step():
        pass
    wait()
    shape = _medians(first_picture, [0.01 * (k + 1) for k in range(int(runs))])
    color = _medians(recolored, [1.0 + 0.01 * k for k in range(int(runs) + 2)])
    shown(1.0)
    refined = {}
    started = time.perf_counter()
    while session.step():
        done = session.samples_done
        if done in (1, 2, 4, 8, 16, 32, 64) and str(done) not in refined:
            wait()
            refined[str(done)] = time.perf_counter() - started
    write_exr(Path(folder) / f"relume-{shadows}.exr", session.render().combined)
    return {
        "triangles": len(arrays.geometry),
        "lights": len(arrays.lights),
        "load_s": loaded,
        "first_view_s": first_view,
        "shape_s": shape,
        "color_s": color,
        "refined_s": refined,
    }


def cycles(scene_path: str, size: str, samples: str, folder: str) -> dict[str, Any]:
    """Seconds of renders after an edit of the key light, with what Cycles keeps between them."""
    opened = _prepared(scene_path, size)
    opened.render.use_persistent_data = True
    opened.cycles.samples = 1
    _render(opened)  # builds what is kept
    seconds = {}
    for count in map(int, samples.split(",")):
        opened.cycles.samples = count
        opened.objects["Key"].data.energy *= 1.000001
        out = Path(folder) / f"cycles-{count}.exr"
        started = time.perf_counter()
        _render(opened, out)
        seconds[str(count)] = time.perf_counter() - started
    return {"seconds": seconds}


def truth(scene_path: str, size: str, samples: str, folder: str) -> dict[str, Any]:
    """The reference: each light alone, with so many samples."""
    from addon.progress import silent
    from tools import reference

    opened = _prepared(scene_path, size)
    made = reference.render_reference(opened, opened.camera, int(samples), silent)
    made.write(Path(folder) / TRUTH)
    return {"noise_floor": made.noise_floor()}


def eevee(scene_path: str, size: str, samples: str) -> dict[str, Any]:
    """Seconds of EEVEE's renders with its shadows, by samples."""
    opened = _prepared(scene_path, size)
    opened.render.engine = "BLENDER_EEVEE"
    opened.eevee.use_raytracing = False
    opened.eevee.taa_render_samples = 1
    _render(opened)  # compiles its shaders
    seconds = {}
    for count in map(int, samples.split(",")):
        opened.eevee.taa_render_samples = count
        times = []
        for _ in range(3 if count == 1 else 1):
            opened.objects["Key"].data.energy *= 1.000001
            started = time.perf_counter()
            _render(opened)
            times.append(time.perf_counter() - started)
        seconds[str(count)] = float(np.median(times))
    return {"seconds": seconds}


def errors(folder: str) -> dict[str, Any]:
    """PSNR of every picture in FOLDER against the reference there."""
    from tools.comparison import compare_pictures
    from tools.picture_file import read_picture

    reference = read_picture(Path(folder) / TRUTH)
    psnr = {}
    for path in sorted(Path(folder).glob("*.exr")):
        if path.name != TRUTH:
            report = compare_pictures(reference, read_picture(path)).report
            psnr[path.stem] = {
                "whole": report["whole"]["psnr"],
                "away": report["away_from_edges"]["psnr"],
            }
    return psnr


def _open(scene_path: str) -> Any:
    from tools.scene_file import load_blender, open_scene

    load_blender()
    return open_scene(Path(scene_path))


def _prepared(scene_path: str, size: str) -> Any:
    """The scene for direct light only, with the key light where all renderers see it."""
    from mathutils import Vector

    from tools import reference

    opened = _open(scene_path)
    opened.objects["Key"].location += Vector(KEY_SHIFT)
    reference.prepare(opened)
    opened.render.resolution_x, opened.render.resolution_y = _size(size)
    opened.render.resolution_percentage = 100
    opened.cycles.use_adaptive_sampling = False
    return opened


def _render(opened: Any, out: Path | None = None) -> None:
    import bpy

    opened.render.image_settings.file_format = "OPEN_EXR"
    opened.render.image_settings.color_depth = "32"
    opened.render.filepath = str(out) if out is not None else ""
    bpy.ops.render.render(write_still=out is not None)


def _size(size: str) -> tuple[int, int]:
    width, height = map(int, size.split("x"))
    return width, height


def _medians(act: Callable[[float], None], values: list[float]) -> float:
    """Median seconds; the first two times, when shaders compile and sums are built, do not
    count."""
    times = []
    for value in values:
        started = time.perf_counter()
        act(value)
        times.append(time.perf_counter() - started)
    return float(np.median(times[2:]))


def _finished(texture: Any) -> None:
    """Wait until the GPU has drawn a texture."""
    from addon.glsl.shader import framebuffer

    target = framebuffer([texture])
    with target.bind():
        target.read_color(0, 0, 1, 1, 4, 0, "FLOAT")


STEPS = {step.__name__: step for step in (scene, edits, cycles, truth, eevee, errors)}


def main() -> None:
    """Run one step."""
    name, *words = sys.argv[1:]
    print(json.dumps(STEPS[name](*words)))  # type: ignore[operator]


if __name__ == "__main__":
    main()
