# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps of `benchmarks.caching` that run as processes of their own.

Blender keeps state and memory of one step that another must not find. Each prints one line of
JSON.

    python -m benchmarks.caching_run place SCENE.blend PRESET CAMERAS.json [PLACED.json]
    python -m benchmarks.caching_run bake SCENE.blend PRESET CAMERAS.json CACHE [exact]
    python -m benchmarks.caching_run textures SCENE.blend CACHE
    python -m benchmarks.caching_run error SCENE.blend SHIPPED EXACT CAMERA WxH N N FOLDER
    python -m benchmarks.caching_run frame SCENE.blend CAMERA SAMPLES,SAMPLES
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any

from addon.caching.presets import PRESETS

from .caching_figures import MadeTexture

# The frame that a bake's time is held against.
FRAME_SIZE = (1920, 1080)


def place(scene_path: str, preset: str, out: str, *placed: str) -> dict[str, Any]:
    """Place caching cameras as a bake does that finds none, or take those that were placed; the
    name of the shot's camera."""
    from addon.camplace.cameras_file import read_cameras, to_json
    from addon.camplace.place import place_cameras
    from addon.camplace.settings import PlacementSettings
    from addon.scene.shot_reader import read_shot
    from tools.relit import camera_names, read_scene

    scene = _open(scene_path)
    geometry, views = read_scene(scene).geometry, read_shot(scene)
    started = time.perf_counter()
    if placed:
        cameras = read_cameras(Path(placed[0]))
    else:
        settings = PlacementSettings(max_resolution=PRESETS[preset].max_resolution)  # type: ignore[index]
        cameras = place_cameras(geometry, views, settings).cameras
    seconds = time.perf_counter() - started
    Path(out).write_text(json.dumps(to_json(cameras)), encoding="utf-8")
    first = camera_names(scene)[0]
    return {
        "triangles": len(geometry),
        "camera": scene.camera.name if scene.camera else first,
        "pictures": len(cameras),
        "seconds": seconds,
    }


def bake(scene_path: str, preset: str, cameras: str, cache: str, *options: str) -> dict[str, Any]:
    """Bake; with `exact`, every channel in float32. Seconds with the reading of the scene."""
    from addon.caching.bake import BakeSettings, bake_scene
    from addon.camplace.cameras_file import read_cameras
    from tools.relit import read_scene

    scene = _open(scene_path)
    placed = read_cameras(Path(cameras))
    started, cpu = time.perf_counter(), time.process_time()
    geometry = read_scene(scene).geometry
    read = time.perf_counter()
    settings = BakeSettings(preset, overwrite=True)  # type: ignore[arg-type]
    with nothing_rounded() if "exact" in options else nullcontext():
        report = bake_scene(scene, geometry, placed, Path(cache), settings)
    return {
        **report.to_json(),
        "read_scene_s": read - started,
        "whole_s": time.perf_counter() - started,
        "cpu_s": time.process_time() - cpu,
    }


@contextmanager
def nothing_rounded() -> Iterator[None]:
    """Every channel counts as one that half precision does not hold, and is kept as float32 on
    disk and on the GPU; directions count as any three numbers where they are stored and packed."""
    from addon.caching.channels import CHANNEL_BY_NAME, Channel

    class PlainChannel(Channel):
        """One that has no code of its own."""

        is_direction = False

    def all_of_them(channels: Any) -> frozenset[str]:
        return frozenset(channels)

    plain = {name: PlainChannel(**vars(channel)) for name, channel in CHANNEL_BY_NAME.items()}
    changes: list[tuple[str, str, Any]] = [
        (module, "CHANNEL_BY_NAME", plain)
        for module in ("framebuffer", "framebuffer_file", "packing")
    ]
    changes.append(("framebuffer", "wide_channels", all_of_them))
    kept: list[tuple[Any, str, Any]] = []
    try:
        for name, key, value in changes:
            module = import_module(f"addon.caching.{name}")
            kept.append((module, key, getattr(module, key)))
            setattr(module, key, value)
        yield
    finally:
        for module, key, value in kept:
            setattr(module, key, value)


def textures(scene_path: str, cache: str) -> dict[str, Any]:
    """What the GPU is given of a cache before a view is looked at."""
    from tools.relit import open_session, read_scene

    arrays = read_scene(_open(scene_path))
    with made_textures() as made:
        session = open_session(arrays, Path(cache), 1)
    # What was made holds the textures, too, from which blocks were drawn to their places.
    return {
        "gpu_bytes": session.cache_bytes,
        "textures": [vars(texture) for texture in made],
    }


@contextmanager
def made_textures() -> Iterator[list[MadeTexture]]:
    """Gives the textures that are made on the GPU in this block."""
    import gpu

    make, made = gpu.types.GPUTexture, []

    def noted(size: Any, *args: Any, layers: int = 0, format: str = "RGBA8", **others: Any) -> Any:  # noqa: A002 - Blender's name
        width, height = size
        made.append(MadeTexture(width, height, max(layers, 1), format))
        return make(size, *args, layers=layers, format=format, **others)

    gpu.types.GPUTexture = noted
    try:
        yield made
    finally:
        gpu.types.GPUTexture = make


def error(  # noqa: PLR0917 - the words of one command line
    scene_path: str,
    shipped: str,
    exact: str,
    camera: str,
    size: str,
    samples: str,
    reference_samples: str,
    folder: str,
) -> dict[str, Any]:
    """Relight a view from both caches; PSNR and FLIP of each against Cycles, direct light only,
    and of one against the other."""
    from addon.progress import silent
    from tools import reference
    from tools.comparison import compare_pictures
    from tools.picture_file import read_picture, write_exr
    from tools.relit import open_session, read_scene, read_views

    scene = _open(scene_path)
    arrays = read_scene(scene)
    width, height = map(int, size.split("x"))
    (view,) = read_views(scene, [camera], (width, height))
    at = {name: Path(folder) / f"{name}.exr" for name in ("reference", "shipped", "exact")}
    for name, cache in (("shipped", shipped), ("exact", exact)):
        with nothing_rounded() if name == "exact" else nullcontext():
            session = open_session(arrays, Path(cache), int(samples))
            session.set_view(view)
            picture = session.render()
        write_exr(at[name], picture.combined)
        # Before the other cache takes its room.
        del session
    reference.prepare(scene)
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    truth = reference.render_reference(scene, scene.objects[camera], int(reference_samples), silent)
    truth.write(at["reference"])
    pictures = {name: read_picture(path) for name, path in at.items()}
    figures = {
        name: compare_pictures(pictures[first], pictures[second]).report["whole"]
        for name, first, second in (
            ("shipped", "reference", "shipped"),
            ("exact", "reference", "exact"),
            ("apart", "exact", "shipped"),
        )
    }
    holes = picture.coverage.hole_fraction
    return {**figures, "noise_floor": truth.noise_floor(), "hole_fraction": holes}


def frame(scene_path: str, camera: str, samples: str) -> dict[str, Any]:
    """Seconds of a 1920x1080 frame with the scene's own light paths, by samples of a pixel."""
    import bpy

    scene = _open(scene_path)
    scene.camera = scene.objects[camera]
    render, cycles = scene.render, scene.cycles
    render.engine, cycles.device = "CYCLES", "CPU"
    # As many samples as are named, and nothing that is not Cycles.
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.time_limit = 0.0
    for layer in scene.view_layers:
        layer.samples = 0
    render.use_persistent_data = render.use_compositing = render.use_sequencer = False
    render.use_border = False
    render.resolution_x, render.resolution_y = FRAME_SIZE
    # Blender loads the images with the first picture, and keeps them.
    render.resolution_percentage, cycles.samples = 5, 1
    bpy.ops.render.render()
    render.resolution_percentage = 100
    seconds: dict[str, float] = {}
    for count in sorted({int(number) for number in samples.split(",")}):
        cycles.samples = count
        started = time.perf_counter()
        bpy.ops.render.render()
        seconds[str(count)] = time.perf_counter() - started
    return {"seconds": seconds, "max_bounces": cycles.max_bounces}


def _open(path: str) -> Any:
    from tools.scene_file import open_scene

    return open_scene(Path(path))


STEPS: dict[str, Callable[..., dict[str, Any]]] = {
    "place": place,
    "bake": bake,
    "textures": textures,
    "error": error,
    "frame": frame,
}

if __name__ == "__main__":
    from tools.output import standard_output, to_json

    with standard_output() as out:
        result = STEPS[sys.argv[1]](*sys.argv[2:])
        out.write(json.dumps(json.loads(to_json(result))) + "\n")
