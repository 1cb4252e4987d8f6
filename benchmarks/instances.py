# SPDX-License-Identifier: GPL-3.0-or-later
"""What keeping a repeated mesh once saves, and what it costs.

    python -m benchmarks.instances [--copies 1000] [--triangles 10000] [--size 640x480] [--runs 7]

A forest of copies of one tree is put on the GPU twice: each copy with triangles of its own
(flattened), and one tree with a table of places (instanced). Memory is what a process of its own
for each of them has more of afterwards, which with software OpenGL is the GPU's part too;
processor time is that of both by turns in one process. Made scenes only; nothing is baked.
"""

from __future__ import annotations

import argparse
import gc
import json
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from addon.argument_types import positive
from addon.errors import InputError
from tools.verbs.arguments import size

if TYPE_CHECKING:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.scene.geometry import SceneGeometry
    from addon.scene.view import View

WAYS = ("flattened", "instanced")
# Metres between trees.
STEP = 2.5


def forest(copies: int, triangles: int) -> SceneGeometry:
    """Trees on a jittered grid, read from Blender; the open file is lost."""
    import bpy

    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.geometry_reader import read_geometry

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    rng = np.random.default_rng(1)
    mesh = _tree(triangles, rng)
    columns = int(np.ceil(np.sqrt(copies)))
    for number in range(copies):
        row, column = divmod(number, columns)
        tree = bpy.data.objects.new(f"Tree {number}", mesh)
        x, y = np.array([column, row]) * STEP + rng.uniform(-0.8, 0.8, 2)
        tree.location = (x - 0.5 * STEP * columns, y, 0.0)
        tree.rotation_euler = (0.0, 0.0, rng.uniform(0.0, 6.3))
        tree.scale = rng.uniform(0.7, 1.3, 3)
        scene.collection.objects.link(tree)
    bpy.ops.mesh.primitive_plane_add(size=8.0 * STEP * columns)
    geometry: SceneGeometry = with_render_depsgraph(scene, read_geometry)
    return geometry


def _tree(triangles: int, rng: np.random.Generator) -> Any:
    """Smooth leaves of two triangles about a stem."""
    import bpy

    count = triangles // 2
    height, turn = rng.uniform(0.5, 4.0, count), rng.uniform(0.0, 6.3, count)
    reach = rng.uniform(0.0, 1.0, count) ** 0.5 * (4.2 - height) * 0.35
    middle = np.stack([reach * np.cos(turn), reach * np.sin(turn), height], axis=1)
    side, up = (rng.normal(size=(count, 3)) * 0.05 for _ in range(2))
    corners = np.stack(
        [middle - side, middle + up, middle + side, middle - 0.7 * up + 0.02], axis=1
    )
    mesh = bpy.data.meshes.new("Tree")
    mesh.from_pydata(
        corners.reshape(-1, 3).tolist(), [], np.arange(4 * count).reshape(-1, 4).tolist()
    )
    mesh.polygons.foreach_set("use_smooth", np.ones(count, dtype=bool))
    return mesh


def view_of(pixels: tuple[int, int], number: int) -> View:
    """From the forest's edge into it, a step farther with each number."""
    from addon.scene.view import View

    width, height = pixels
    angle = 0.02 * np.sin(1.7 * number)
    world_from_camera = np.eye(4)
    # Level, looking along +Y.
    right = np.array([np.cos(angle), np.sin(angle), 0.0])
    world_from_camera[:3, 0], world_from_camera[:3, 1] = right, (0.0, 0.0, 1.0)
    world_from_camera[:3, 2] = np.cross(right, (0.0, 0.0, 1.0))
    world_from_camera[:3, 3] = (0.05 * number, -3.0, 1.7)
    near, far, f = 0.1, 1000.0, 1.4
    clip_from_camera = np.diag([f, f * width / height, -(far + near) / (far - near), 0.0])
    clip_from_camera[2, 3], clip_from_camera[3, 2] = -2.0 * far * near / (far - near), -1.0
    return View(world_from_camera, clip_from_camera, width, height)


def put(geometry: SceneGeometry, view: View, way: str) -> GeometryBuffer:
    """A geometry on the GPU, with all its tables."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.seen_triangle import seen_textures

    if not geometry.copies and way == "instanced":
        raise InputError("so few triangles are not kept once; take more copies")
    some = geometry if way == "instanced" else replace(geometry, copies=())
    buffer = GeometryBuffer(some, view.origin)
    seen_textures(buffer, plane=True, ids=True, corners=True)
    return buffer


def memory(way: str, copies: int, triangles: int) -> dict[str, float]:
    """MiB that this process has more of once a forest is on the GPU."""
    import bpy  # noqa: F401 - `gpu` is there from then on

    from tools.gpu_context import open_gpu

    open_gpu()
    geometry = forest(copies, triangles)
    view = view_of((64, 48), 0)
    # Shaders and whatever else is there once.
    _draws(put(forest(1, 600), view, "flattened"))[0][1](view)
    before = _resident()
    buffer = put(geometry, view, way)
    _draws(buffer)[0][1](view)
    return {"triangles": len(geometry), "MiB": _resident() - before}


def _resident() -> float:
    import ctypes

    gc.collect()
    # What Python gave back the C library may still hold.
    ctypes.CDLL(None).malloc_trim(0)
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024.0
    return float("nan")


def _draws(buffer: GeometryBuffer) -> list[tuple[str, Callable[[View], None]]]:
    """Passes to time: each waits for what it draws."""
    from addon.corrmap.shading_normals import ShadingNormalPass
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture
    from addon.relight.shadows.shadow_frustum import ShadowSettings
    from addon.relight.shadows.shadow_pass import ShadowPass

    surfaces, shadows = VisibleSurfacePass(buffer), ShadowPass(buffer, ShadowSettings())
    normals = ShadingNormalPass(buffer)
    toward = np.array([[0.48, 0.0, 0.8770]])
    toward /= np.linalg.norm(toward)

    def look(view: View) -> None:
        read_texture(surfaces.draw(view).position)

    def look_and_bend(view: View) -> None:
        read_texture(normals.draw(surfaces.draw(view)))

    def cast(_: View) -> None:
        shadow = shadows.draw_parallel(toward, buffer.bounds, buffer.bounds, 512)
        read_texture(shadow.distance)

    return [
        ("visible surface", look),
        ("visible surface and normals", look_and_bend),
        ("shadow map of a sun", cast),
    ]


def times(
    copies: int, triangles: int, pixels: tuple[int, int], runs: int
) -> dict[str, dict[str, float]]:
    """Median processor seconds of each pass and way, by turns."""
    import bpy  # noqa: F401 - `gpu` is there from then on

    from tools.gpu_context import open_gpu

    open_gpu()
    geometry = forest(copies, triangles)
    found: dict[str, dict[str, list[float]]] = {}
    buffers = {}
    for way in WAYS:
        started = time.process_time()
        buffers[way] = put(geometry, view_of(pixels, 0), way)
        found.setdefault("to the GPU", {})[way] = [time.process_time() - started]
    draws = {way: _draws(buffer) for way, buffer in buffers.items()}
    for run in range(-1, runs):
        for way in WAYS if run % 2 else WAYS[::-1]:
            for name, draw in draws[way]:
                started = time.process_time()
                draw(view_of(pixels, run))
                took = time.process_time() - started
                # The first compiles shaders.
                if run >= 0:
                    found.setdefault(name, {}).setdefault(way, []).append(took)
    return {
        name: {way: float(np.median(each)) for way, each in ways.items()}
        for name, ways in found.items()
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.instances")
    parser.add_argument("--copies", type=positive, default=1000)
    parser.add_argument("--triangles", type=positive, default=10_000, help="of the tree")
    parser.add_argument("--size", type=size, default=(640, 480))
    parser.add_argument("--runs", type=positive, default=7)
    parser.add_argument("--memory-of", choices=WAYS, help=argparse.SUPPRESS)
    args = parser.parse_args(arguments)
    if args.memory_of:
        print(json.dumps(memory(args.memory_of, args.copies, args.triangles)))
        return 0
    scene = ["--copies", str(args.copies), "--triangles", str(args.triangles)]
    for way in WAYS:
        command = [sys.executable, "-m", "benchmarks.instances", *scene, "--memory-of", way]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        row = json.loads(done.stdout.strip().splitlines()[-1])
        print(f"{way}: {row['triangles']:,.0f} triangles, {row['MiB']:.0f} MiB more", flush=True)
    for name, ways in times(args.copies, args.triangles, args.size, args.runs).items():
        flat, own = (ways[way] for way in WAYS)
        print(f"{name}: {flat:.3f} s flattened, {own:.3f} s instanced, {flat / own:.2f} times")
    return 0


if __name__ == "__main__":
    sys.exit(main())
