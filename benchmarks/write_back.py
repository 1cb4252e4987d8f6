# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights' controls as Relume shows them, and as Cycles does with what is written back.

    python -m benchmarks.write_back [--out out/write_back] [--size 160] [--samples 32]

A floor and two balls are baked once. For each control the light is relit by Relume, and rendered
by Cycles (direct light only) with the nodes that "Write to Cycles" makes. Leaves in the folder a
sheet of the pictures and their differences, eight times as bright, and a table of the errors:
decibels of display-encoded pictures, of all pixels and of those away from surfaces' edges.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from addon.caching.bake import bake_scene
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.light_controls import (
    BarnDoors,
    Blocker,
    DistanceRange,
    Falloff,
    LightControls,
    Noise,
    Slide,
    Superellipse,
)
from addon.scene.light_reader import read_lights
from addon.scene.view_reader import read_view
from addon.ui import write_back
from tests.cycles_stage import CyclesStage
from tools.contact_sheet import Cell, Row, write_sheet
from tools.edges import surface_edges
from tools.gpu_context import open_gpu
from tools.metrics import encode_srgb, psnr

KINDS = ("POINT", "SPOT", "AREA")
DIFFERENCE_GAIN = 8.0


@dataclass(frozen=True)
class Compared:
    """One control of one light."""

    control: str
    kind: str
    relit: NDArray[np.float64]
    cycles: NDArray[np.float64]
    edge: NDArray[np.bool_]

    def decibels(self, *, away: bool) -> float:
        squared = (encode_srgb(self.relit) - encode_srgb(self.cycles)) ** 2
        chosen = squared[~self.edge] if away else squared
        return psnr(255.0**2 * float(chosen.mean()))

    def row(self) -> str:
        whole, away = self.decibels(away=False), self.decibels(away=True)
        return f"| {self.control} | {self.kind.lower()} | {whole:.1f} dB | {away:.1f} dB |"

    def cells(self) -> tuple[Cell, ...]:
        relit, cycles = encode_srgb(self.relit), encode_srgb(self.cycles)
        difference = np.clip(DIFFERENCE_GAIN * np.abs(relit - cycles), 0.0, 1.0)
        decibels = f"{self.decibels(away=True):.1f} dB"
        kind = f"{self.kind.lower()} light"
        return (
            Cell(relit, "Relume", kind),
            Cell(cycles, "Cycles", kind),
            Cell(difference, "difference", decibels),
        )


def sheet_rows(results: list[Compared]) -> list[Row]:
    """A row for each control, with all kinds of lights."""
    rows: dict[str, list[Cell]] = {}
    for result in results:
        rows.setdefault(result.control, []).extend(result.cells())
    return [Row(name, cells) for name, cells in rows.items()]


def controls(flag: Any) -> dict[str, LightControls]:
    """Each control by itself, and all together."""
    y, x = np.mgrid[0:96, 0:96] / 96.0
    window = np.ones((96, 96, 4), dtype=np.float32)
    bars = (np.abs(x - 0.5) > 0.03) & (np.abs(y - 0.5) > 0.03)
    window[..., 0], window[..., 1], window[..., 2] = bars, bars * (0.4 + 0.6 * y), bars * x
    card = Blocker(
        flag.name,
        np.array(flag.matrix_world, dtype=np.float64),
        Superellipse(0.8, 0.6, 0.4, 0.4, 0.5),
        0.9,
        (0.3, 0.1, 0.0),
    )
    single = {
        "barn doors": LightControls(
            barn_doors=BarnDoors(Superellipse(0.5, 0.35, 0.2, 0.2, 0.6), (0.1, 0.0), 0.3)
        ),
        "near and far": LightControls(distance=DistanceRange(1.6, 0.3, 2.2, 0.5)),
        "falloff": LightControls(falloff=Falloff(0.0, 2.0)),
        "slide": LightControls(slide=Slide(window, "Window", "SLIDE", blur=0.02, rotation=0.2)),
        "cookie": LightControls(slide=Slide(window, "Window", scale=(0.5, 0.5), repeat=True)),
        "noise": LightControls(noise=Noise(1.0, 5.0)),
        "blocker": LightControls(blockers=(card,)),
    }
    parts = {
        k: v for c in single.values() for k, v in vars(c).items() if v != vars(LightControls())[k]
    }
    return {**single, "all together": LightControls(**parts)}


class Studio:
    """The stage in Blender, and a session on its cache."""

    def __init__(self, kind: str, size: int, folder: Path) -> None:
        self.stage = CyclesStage(kind, folder, size)
        scene = self.stage.scene
        light = self.stage.light
        light.data.use_shadow = True
        # So that most of every picture is less than white, which would hide differences.
        light.data.energy = 20.0 if kind == "AREA" else 60.0
        if kind == "SPOT":
            light.data.spot_size, light.data.spot_blend = 1.1, 0.4
        if kind == "AREA":
            light.data.shape, light.data.size, light.data.size_y = "RECTANGLE", 0.3, 0.2
        self.flag = bpy.data.objects.new("Flag", None)
        self.flag.location, self.flag.scale = (0.3, -0.4, 1.2), (0.3, 0.2, 1.0)
        scene.collection.objects.link(self.flag)
        scene.view_layers[0].update()
        geometry = with_render_depsgraph(scene, read_geometry)
        camera = scene.camera
        world_from_camera = np.array(camera.matrix_world, dtype=np.float64)
        # A little wider than the view, and four times as fine.
        caching = CachingCamera(
            0, world_from_camera, float(camera.data.angle) * 1.02, 0.1, 50.0, 4 * size,
            "PERSPECTIVE", 0,
        )  # fmt: skip
        bake_scene(scene, geometry, [caching], folder / "cache")
        open_gpu()
        from addon.relight.session import RelightSession

        self._session = RelightSession(geometry, CacheStore.open(folder / "cache"), 1)

    def relit(self, shaping: LightControls, samples: int) -> NDArray[np.float64]:
        """(H, W, 3)."""
        from dataclasses import replace

        scene = self.stage.scene
        lights, view = with_render_depsgraph(
            scene, lambda d: (read_lights(d), read_view(d, scene.camera))
        )
        self._session.set_samples(samples)
        self._session.set_lights([replace(light, controls=shaping) for light in lights])
        self._session.set_view(view)
        return self._session.render().combined[..., :3].astype(np.float64)

    def compare(self, name: str, shaping: LightControls, samples: int) -> Compared:
        data = self.stage.light.data
        is_soft = data.type == "AREA"
        relit = self.relit(shaping, samples if is_soft else 1)
        write_back.write(data, shaping)
        try:
            cycles, position, _ = self.stage.render(8 * samples if is_soft else 4)
        finally:
            write_back.remove(data)
        camera = np.array(self.stage.scene.camera.matrix_world, dtype=np.float64)
        depth = (camera[:3, 3] - position) @ camera[:3, 2]
        depth = np.where(self.stage.objects > 0, depth, 0.0).astype(np.float32)
        width = 2.0 * np.tan(0.5 * self.stage.scene.camera.data.angle) / depth.shape[1]
        edge = surface_edges(depth, self.stage.objects, float(width), perspective=True)
        return Compared(name, data.type, relit, cycles, edge)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.write_back", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/write_back"))
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--samples", type=int, default=32)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    results: list[Compared] = []
    for kind in KINDS:
        with tempfile.TemporaryDirectory() as folder:
            studio = Studio(kind, args.size, Path(folder))
            for name, shaping in controls(studio.flag).items():
                results.append(studio.compare(name, shaping, args.samples))
                print(results[-1].row(), file=sys.stderr, flush=True)
    table = ["| control | light | whole picture | away from edges |", "| --- | --- | --- | --- |"]
    table += [result.row() for result in results]
    (args.out / "table.md").write_text("\n".join(table) + "\n", encoding="utf-8")
    write_sheet(
        args.out / "sheet.png",
        "Controls written back",
        "Relume, Cycles with the nodes that are written, and the difference eight times as bright, "
        "with its decibels away from surfaces' edges",
        sheet_rows(results),
        column=args.size,
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
