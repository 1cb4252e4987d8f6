# SPDX-License-Identifier: GPL-3.0-or-later
"""What one light costs at each pixel, in bytes and time, beside what the machine can do.

    python -m benchmarks.relight_cost

The light pass is run over random surfaces, of which every pixel has all lobes and is lit. Its time
is held against two passes made for it: one that only reads and writes pixels, and one that only
multiplies and adds. So its time can be said in operations that the machine could have done in it,
and the bytes that it moves (counted from the surfaces' layout) beside those that it could have
moved. On a GPU that shares its time with others, as on a software one, ratios alone mean something.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

SIZE = 512
# Multiply-adds of a vec4 in the pass that does nothing else.
FMAS = 512
# float32 texels, and the bytes that one of them has.
RGBA32F = 16


@dataclass(frozen=True)
class PixelCost:
    """What one light takes of each pixel.

    Attributes:
        name: of the case.
        nanoseconds: median.
        bytes_moved: read and written.
        operations: float32 operations that the machine could have done meanwhile.
        share_of_bandwidth: of the bytes that it could have moved meanwhile.
    """

    name: str
    nanoseconds: float
    bytes_moved: int
    operations: float
    share_of_bandwidth: float


def main() -> int:
    """Print the table and write it as JSON."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.relight_cost",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--runs", type=int, default=15, metavar="N")
    parser.add_argument("--out", type=Path, default=Path("out/relight-cost.json"))
    args = parser.parse_args()
    costs, machine = measure(args.runs)
    print(
        f"the machine: {machine['bytes_per_s'] / 1e9:.1f} GB/s, "
        f"{machine['operations_per_s'] / 1e9:.1f} GFLOP/s\n"
    )
    print(table(costs))
    args.out.parent.mkdir(parents=True, exist_ok=True)
    report = {"machine": machine, "costs": [vars(cost) for cost in costs]}
    args.out.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    print(f"\nwrote {args.out}")
    return 0


def table(costs: list[PixelCost]) -> str:
    """As Markdown."""
    rows = [
        "| surfaces and light | ns a pixel | bytes moved | as many operations | of the bandwidth |",
        "| --- | --- | --- | --- | --- |",
    ]
    rows += [
        f"| {cost.name} | {cost.nanoseconds:.0f} | {cost.bytes_moved} | {cost.operations:.0f} | "
        f"{100.0 * cost.share_of_bandwidth:.0f} % |"
        for cost in costs
    ]
    return "\n".join(rows)


def measure(runs: int) -> tuple[list[PixelCost], dict[str, float]]:
    """The costs of every case, and what the machine does a second."""
    import bpy  # noqa: F401 - gives `gpu`

    from tools.gpu_context import open_gpu

    open_gpu()
    bytes_per_s, operations_per_s = _bandwidth(runs), _arithmetic(runs)
    costs = []
    for name, run, moved in _cases():
        seconds = _median(run, runs) / SIZE**2
        costs.append(
            PixelCost(
                name,
                1e9 * seconds,
                moved,
                seconds * operations_per_s,
                moved / (seconds * bytes_per_s),
            )
        )
    return costs, {"bytes_per_s": bytes_per_s, "operations_per_s": operations_per_s}


def _cases() -> list[tuple[str, Callable[[], None], int]]:
    """(name, what runs one light's pass to its end, bytes that it moves for each pixel)."""
    from addon.glsl.shader import framebuffer, texture_2d, texture_from_array
    from addon.relight.layers.fence import Fence
    from addon.relight.light_points.light_sample import light_sample
    from addon.relight.lights.light_pass import LightPass
    from addon.relight.shading.albedo_pass import AlbedoTextures
    from addon.relight.shading.picture_tiles import PictureTiles
    from addon.relight.shadows.spot_looks import ALL_SPOTS
    from addon.relight.shadows.traced_shadow import TracedShadow
    from addon.scene.light import Light
    from tests.reference.surfaces import random_surfaces

    fence, tables = Fence(), AlbedoTextures()
    layer = texture_2d(SIZE, SIZE)
    target = framebuffer([layer])
    spots = np.full((SIZE, SIZE, 1), ALL_SPOTS, dtype=np.float32)
    whole = PictureTiles.around(np.ones((SIZE, SIZE), dtype=bool))
    seen = TracedShadow(texture_from_array(spots, "R32F"), 0, whole, has_spots=False)
    place = np.eye(4)
    place[:3, 3] = (0.0, 0.0, 40.0)
    diffuse = ("roughness", "specular_f0", "specular_f90", "layer_f0", "layer_f90", "dielectric")
    full = random_surfaces(1, SIZE)
    kinds: dict[str, Any] = {
        "diffuse": _only(full, ("normal", "diffuse_color")),
        "diffuse under a dielectric layer": _only(full, ("normal", "diffuse_color", *diffuse)),
        "everything that a lobe can have": full,
    }
    cases: list[tuple[str, Callable[[], None], int]] = []
    for name, surface in kinds.items():
        buffer = surface.upload()
        light_pass = LightPass(tables, buffer.layout)
        for kind in ("POINT", "AREA") if name == "diffuse" else ("POINT",):
            light = Light("l", kind, place, 100.0, np.ones(3))
            for shadow in (None, seen):

                def run(
                    light: Light = light,
                    shadow: TracedShadow | None = shadow,
                    buffer: Any = buffer,
                    light_pass: LightPass = light_pass,
                ) -> None:
                    light_pass.draw(buffer, light, light_sample(light, 0, 1), target, shadow=shadow)
                    fence.wait(layer)

                textures = 2 + buffer.layout.texture_count
                # The layer is read and written, as the pass adds to it.
                moved = RGBA32F * (textures + 2) + 4 * (shadow is not None)
                shadowed = ", shadow" if shadow is not None else ""
                cases.append((f"{name}; {kind.lower()}{shadowed}", run, moved))
    return cases


def _only(surface: Any, fields: tuple[str, ...]) -> Any:
    from addon.caching.channels import CHANNEL_BY_NAME

    others = {CHANNEL_BY_NAME[name].field for name in surface.channels} - set(fields)
    return surface.without(*others)


def _bandwidth(runs: int) -> float:
    """Bytes a second of the pass that adds up four textures."""
    from addon.glsl.shader import framebuffer, texture_2d
    from addon.relight.layers.fence import Fence
    from addon.relight.layers.sum_pass import Addend, SumPass

    fence, sums = Fence(), SumPass()
    textures = [texture_2d(SIZE, SIZE) for _ in range(5)]
    target = framebuffer([textures[0]])

    def run() -> None:
        sums.draw([Addend(texture) for texture in textures[1:]], target)
        fence.wait(textures[0])

    return RGBA32F * 5 * SIZE**2 / _median(run, runs)


def _arithmetic(runs: int) -> float:
    """float32 operations a second of a pass that multiplies and adds vec4s."""
    from addon.glsl.shader import PassShader, framebuffer, texture_2d
    from addon.relight.layers.fence import Fence

    fence, texture = Fence(), texture_2d(SIZE, SIZE)
    target = framebuffer([texture])
    program = PassShader(
        name="arithmetic",
        fragment="sum_layers",
        outputs=(("VEC4", "radiance"),),
        generated=(
            "vec4 sum_of_layers(ivec2 pixel)\n{\n"
            "  vec4 a = vec4(pixel, pixel.yx) * 1e-6, b = a, c = a, d = a;\n"
            f"  for (int i = 0; i < {FMAS // 4}; i++) {{\n"
            "    a = a * 0.999 + 0.001; b = b * 0.998 + 0.002;\n"
            "    c = c * 0.997 + 0.003; d = d * 0.996 + 0.004;\n"
            "  }\n  return a + b + c + d;\n}\n"
        ),
    ).build()

    def run() -> None:
        program.draw_fullscreen(target, {}, {})
        fence.wait(texture)

    # A vec4's multiply-add is eight operations.
    return 8.0 * FMAS * SIZE**2 / _median(run, runs)


def _median(run: Callable[[], None], runs: int) -> float:
    """Seconds; the first run compiles."""
    run()
    times = []
    for _ in range(runs):
        started = time.perf_counter()
        run()
        times.append(time.perf_counter() - started)
    return float(np.median(times))


if __name__ == "__main__":
    sys.exit(main())
