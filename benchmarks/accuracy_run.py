# SPDX-License-Identifier: GPL-3.0-or-later
"""One set-up of `benchmarks.accuracy`, in a process of its own.

    python -m benchmarks.accuracy_run SETUP --folder F --counts 16 64 --lights "point" "sun" ...

Leaves for each light F/SETUP/LIGHT.npz with the two halves of Cycles' picture and each of
Relume's, and prints how far it is. Files of Cycles' that are there are used again.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from addon.caching.bake import bake_scene
from addon.caching.store import CacheStore
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.light_reader import read_lights
from addon.scene.view_reader import read_view
from addon.scene.world_reader import read_world
from tools import reference
from tools.edges import surface_edges
from tools.gpu_context import open_gpu
from tools.picture_file import PictureFile

from .accuracy_cases import LIGHTS, add_light, is_soft
from .accuracy_scenes import SETUPS, Setup, build

# Cycles' samples for each half of a reference, of lights whose points differ and of others: of
# these only pixels at shadows' edges need more than one.
SOFT_SAMPLES, HARD_SAMPLES = 128, 64


def file_name(light: str) -> str:
    """A light's part of its files' names."""
    return light.replace(", ", "_").replace(" ", "-")


class Run:
    """The open set-up, relit and rendered for one light after another."""

    def __init__(self, name: str, folder: Path, shadows: str = "traced") -> None:
        self._setup: Setup = build(name)
        self._folder = folder / name
        self._folder.mkdir(parents=True, exist_ok=True)
        self._shadows: Any = shadows
        self._session: Any = None
        self._guides: dict[str, np.ndarray] = {}

    def light(self, name: str, counts: list[int]) -> None:
        """Measure one light."""
        add_light(self._setup.scene, name, self._setup.world_from_light, self._setup.scale)
        try:
            pictures = {f"relit {count}": self._relit(count) for count in counts}
            pictures |= self._reference(name)
        finally:
            for obj in [o for o in bpy.data.objects if o.type == "LIGHT"]:
                bpy.data.objects.remove(obj)
        np.savez_compressed(self._folder / f"{file_name(name)}.npz", **pictures)

    def _open(self) -> Any:
        from addon.relight.session import RelightSession
        from addon.relight.shadows.shadow_frustum import ShadowSettings

        scene, cache = self._setup.scene, self._folder / "cache"
        geometry = with_render_depsgraph(scene, read_geometry)
        if not (cache / "manifest.json").is_file():
            world, scene.world = scene.world, bpy.data.worlds["gradient"]
            bake_scene(scene, geometry, [self._setup.caching], cache)
            scene.world = world
        open_gpu()
        shadows = ShadowSettings(method=self._shadows)
        return RelightSession(geometry, CacheStore.open(cache), 1, shadows)

    def _relit(self, count: int) -> np.ndarray:
        """(H, W, 3)."""
        scene = self._setup.scene
        lights, world, view = with_render_depsgraph(
            scene, lambda d: (read_lights(d), read_world(d), read_view(d, scene.camera))
        )
        if self._session is None:
            self._session = self._open()
        session = self._session
        session.set_samples(count)
        session.set_lights(lights)
        session.set_world(world)
        session.set_view(view)
        return np.asarray(session.render().combined[..., :3])

    def _reference(self, name: str) -> dict[str, np.ndarray]:
        """The two halves, the lobes' numbers and what is at an edge."""
        path = self._folder / f"{file_name(name)}.cycles.npz"
        if path.is_file():
            return dict(np.load(path))
        scene = self._setup.scene
        reference.prepare(scene)
        scene.view_layers[0].use_pass_material_index = True
        samples = SOFT_SAMPLES if is_soft(name) else HARD_SAMPLES
        halves: list[PictureFile] = [
            reference.render_passes(scene, self._folder / "cycles.exr", samples, seed)
            for seed in (11, 12)
        ]
        depth = reference.pass_of(halves[0], "Depth.Z")
        lobe = reference.pass_of(halves[0], "Material Index.X")
        depth = np.where(depth < 1e9, depth, 0.0).astype(np.float32)
        pixel, perspective = reference.pixel_size(scene.camera)
        edge = surface_edges(depth, lobe, pixel, perspective=perspective)
        found = {
            "half 0": halves[0].rgb, "half 1": halves[1].rgb, "lobe": lobe.astype(np.int32),
            "edge": edge,
        }  # fmt: skip
        np.savez_compressed(path, **found)
        return found


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy_run")
    parser.add_argument("setup", choices=SETUPS)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--counts", type=int, nargs="+", required=True)
    parser.add_argument("--lights", nargs="+", choices=tuple(LIGHTS), required=True)
    parser.add_argument("--shadows", choices=("map", "traced"), default="traced")
    args = parser.parse_args()
    run = Run(args.setup, args.folder, args.shadows)
    for number, name in enumerate(args.lights, start=1):
        print(f"{args.setup}: {name} ({number} of {len(args.lights)})", file=sys.stderr, flush=True)
        run.light(name, args.counts)
    return 0


if __name__ == "__main__":
    sys.exit(main())
