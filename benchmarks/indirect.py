# SPDX-License-Identifier: GPL-3.0-or-later
"""What shading apart from pixels saves, and what it costs in accuracy.

    python -m benchmarks.indirect SCENE.blend --cache DIR [--camera NAME] [--size 320x240]

One view is relit twice for each number of visibility samples, with as many points of each light:
once shading every sample of every pixel (brute force), once shading the samples that pixels share.
Their difference is what sharing costs. Beside it stand the shading samples of a pixel, the bytes
of the lists and of all surfaces, and the times of the view and of a light edit, from the first
picture to the last.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from addon.argument_types import positive
from tools.verbs.arguments import size

if TYPE_CHECKING:
    from addon.relight.session import RelightSession
    from addon.scene.view import View
    from tools.relit import SceneArrays

VISIBILITY = (1, 4, 16, 64)
# Pictures whose values differ by no more than this share are equal but for rounding.
ROUNDING = 1e-5
_BYTES_PER_RGBA32F = 16


@dataclass(frozen=True)
class Cost:
    """One view, relit one way.

    Attributes:
        samples_per_pixel: shading samples.
        surface_bytes: of all surfaces on the GPU.
        list_bytes: of the pixels' lists.
        view_s: seconds from a new view to the last picture.
        edit_first_s: seconds from the edit of a light to a picture.
        edit_s: seconds from there to the last picture.
    """

    samples_per_pixel: float
    surface_bytes: int
    list_bytes: int
    view_s: float
    edit_first_s: float
    edit_s: float


@dataclass(frozen=True)
class Row:
    """A number of visibility samples, both ways.

    Attributes:
        visibility: of each pixel; the lights have as many points.
        brute, shared: what the two ways cost.
        psnr: of the shared picture against the other, luma as `relume compare` has it, decibels;
            None where they are the same.
        equal: share of pixels that are equal but for rounding.
        unlisted_equal: likewise, of the pixels that have no list.
    """

    visibility: int
    brute: Cost
    shared: Cost
    psnr: float | None
    equal: float
    unlisted_equal: float


def main() -> int:
    """Print the table and write it as JSON."""
    args = _arguments()
    from tools.scene_file import load_blender, open_scene

    load_blender()
    from tools.relit import camera_names, read_scene, read_views

    scene = open_scene(args.scene)
    arrays = read_scene(scene)
    camera = args.camera or camera_names(scene)[0]
    view = read_views(scene, [camera], args.size)[0]
    print(f"{args.scene.name}, {view.name}, {view.width}x{view.height}, light '{_edited(arrays)}'")
    rows = []
    for count in args.visibility:
        rows.append(_row(arrays, args.cache, view, count))
        print(describe(rows[-1]), flush=True)
    report = [asdict(row) for row in rows]
    args.out.parent.mkdir(parents=True, exist_ok=True)
    args.out.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    print(f"wrote {args.out}")
    return 0


def describe(row: Row) -> str:
    """A row in words."""
    brute, shared = row.brute, row.shared
    psnr = "the same" if row.psnr is None else f"{row.psnr:.1f} dB"
    return (
        f"{row.visibility} visibility samples: {shared.samples_per_pixel:.3f} shading samples for "
        f"{brute.samples_per_pixel:.0f}, {shared.surface_bytes / 2**20:.1f} MiB of surfaces for "
        f"{brute.surface_bytes / 2**20:.1f}, lists {shared.list_bytes / 2**20:.2f} MiB; {psnr}, "
        f"{row.equal:.1%} equal ({row.unlisted_equal:.1%} of those without a list); "
        f"view {shared.view_s:.2f} s for {brute.view_s:.2f}, "
        f"edit {shared.edit_first_s:.3f} to {shared.edit_s:.2f} s "
        f"for {brute.edit_first_s:.3f} to {brute.edit_s:.2f}"
    )


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.indirect",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scene", type=Path, metavar="SCENE.blend")
    parser.add_argument("--cache", type=Path, required=True, metavar="DIR")
    parser.add_argument("--camera", metavar="NAME", help="default: the first of the shot's")
    parser.add_argument("--size", type=size, default=(320, 240), metavar="WxH")
    parser.add_argument("--visibility", type=positive, nargs="+", default=VISIBILITY, metavar="N")
    parser.add_argument("--out", type=Path, default=Path("out/indirect.json"))
    return parser.parse_args()


def _row(arrays: SceneArrays, cache: Path, view: View, count: int) -> Row:
    from tools.metrics import encode_srgb, mean_over, psnr, squared_error

    costs, pictures = [], []
    listed = np.zeros((view.height, view.width), dtype=bool)
    for visibility in (0, count):
        cost, picture, session = _relit(arrays, cache, view, (count, visibility))
        costs.append(cost)
        pictures.append(picture.astype(np.float64))
        lists = session._sampler.lists  # noqa: SLF001 - to say which pixels have one
        if lists is not None:
            listed = (lists.lists.count > 0).reshape(listed.shape)
    brute, shared = pictures
    near = np.abs(shared - brute) <= ROUNDING * np.abs(brute).max(axis=-1, keepdims=True)
    equal = near.all(axis=-1)
    _, luma = squared_error(*(encode_srgb(np.maximum(p, 0.0)) * 255.0 for p in (brute, shared)))
    error = mean_over(luma, None)
    return Row(
        count,
        costs[0],
        costs[1],
        psnr(error) if error else None,
        float(equal.mean()),
        float(equal[~listed].mean()),
    )


def _relit(
    arrays: SceneArrays, cache: Path, view: View, counts: tuple[int, int]
) -> tuple[Cost, Any, RelightSession]:
    """A view relit with some samples and visibility samples, and what that took."""
    from addon.relight.session import RelightSession
    from tools.cache_check import check_cache
    from tools.gpu_context import open_gpu

    samples, visibility = counts
    open_gpu()
    store = check_cache(arrays.geometry, cache, arrays.frame)
    session = RelightSession(arrays.geometry, store, samples, visibility=visibility)
    session.set_emitter_linking(arrays.emitter_linking)
    session.set_lights(arrays.lights)
    session.set_world(arrays.world)
    # Once to compile, on a view of nothing that stays.
    session.set_view(replace(view, width=16, height=16))
    session.render()
    session.set_view(view)
    start = time.perf_counter()
    picture = session.render().combined[..., :3]
    view_s = time.perf_counter() - start
    first, last = [], []
    name = _edited(arrays)
    for turn in range(3):
        lights = [_moved(light, turn) if light.name == name else light for light in arrays.lights]
        start = time.perf_counter()
        session.set_lights(lights)
        while session.shown_stride != 1:
            session.step()
        session.draw_combined()
        first.append(time.perf_counter() - start)
        while session.step():
            pass
        last.append(time.perf_counter() - start)
    lists = session._sampler.lists  # noqa: SLF001
    further = 1.0 if lists is None else lists.lists.samples_per_pixel
    textures = session._sampler.layout.texture_count  # noqa: SLF001
    pixels = view.width * view.height
    each = pixels * (2 + textures) * _BYTES_PER_RGBA32F
    if lists is None:
        cost = Cost(samples, each * samples, 0, view_s, _median(first), _median(last))
        return cost, picture, session
    # The plain view, the values once, and a place for each sample of the lights.
    surfaces = each + int(further * pixels * _BYTES_PER_RGBA32F * (textures + 2.5 * samples))
    cost = Cost(further, surfaces, lists.nbytes, view_s, _median(first), _median(last))
    return cost, picture, session


def _edited(arrays: SceneArrays) -> str:
    return arrays.lights[0].name


def _moved(light: Any, turn: int) -> Any:
    """The same light a hundredth of a metre to the side, and once more for each turn."""
    world_from_light = light.world_from_light.copy()
    world_from_light[0, 3] += 0.01 * (turn + 1)
    return replace(light, world_from_light=world_from_light)


def _median(values: Sequence[float]) -> float:
    return float(np.median(values))


if __name__ == "__main__":
    sys.exit(main())
