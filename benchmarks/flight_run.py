# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight through one scene, in a process of its own: see `benchmarks.flight`.

    python -m benchmarks.flight_run SCENE.blend --folder F --frames 240 --size 240x180 --preset P

Leaves F/flight.json with the figures of every frame, and F/sheet.png with the worst of them.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.argument_types import positive
from addon.caching.presets import PRESETS
from addon.errors import InputError
from addon.progress import Cancelled, Progress, part_of
from addon.stopping import stop_signals, stoppable
from tools import metrics
from tools.contact_sheet import Cell, Row, write_sheet
from tools.display import correspondence_colors
from tools.output import progress_on, to_json
from tools.scene_file import load_blender, open_scene
from tools.verbs.arguments import size

from .flight_figures import Flicker, Frame, Seams, flicker, seams, see
from .flight_path import Flight, fly
from .other_views import other_views

# Views beside the scene's cameras that the flight leads past.
OTHERS = 4
# Times which changes are brightened on the sheet: a change of 32 levels is white.
CHANGE_GAIN = 8.0


@dataclass(frozen=True)
class Shown:
    """What the sheet shows of a frame: display-encoded (H, W, 3), and levels (H, W)."""

    picture: NDArray[np.float32]
    cameras: NDArray[np.float32]
    steps: NDArray[np.float32]
    change: NDArray[np.float32]


def run(args: argparse.Namespace, progress: Progress) -> None:
    """Bake what is not baked yet, fly, measure."""
    load_blender()
    from addon.camplace.frame import LocalFrame
    from addon.camplace.rays import RayCaster
    from tools.relit import camera_names, read_scene, read_views, unmixed

    progress(0.0, "opening the scene")
    scene = open_scene(args.scene)
    scene.render.resolution_x, scene.render.resolution_y = args.size
    scene.render.resolution_percentage = 100
    arrays = unmixed(read_scene(scene))
    stops = [v for v in read_views(scene, camera_names(scene)) if v.perspective]
    store = _baked(scene, arrays.geometry, args, part_of(progress, 0.0, 0.3))
    free = np.array([camera.origin for camera in store.manifest.cameras])
    stops += other_views(stops, arrays.geometry, OTHERS)
    flight = fly(stops, free, arrays.geometry, args.frames)
    frame = LocalFrame.of(arrays.geometry, tuple(stops), None)
    near = replace(arrays.geometry, vertices=arrays.geometry.vertices - frame.origin, copies=())
    rays = RayCaster(near)
    # Whoever paints a mesh with two materials makes an edge, which a seam is not to answer for.
    materials = len(near.material_names)
    owner = near.object_id.astype(np.int64) * materials + near.material_id
    session = _session(arrays, store)
    rows: list[dict[str, Any]] = []
    shown: list[Shown] = []
    before: Frame | None = None
    step = part_of(progress, 0.3, 1.0)
    for number, view in enumerate(flight.views):
        step(number / len(flight.views), f"frame {number + 1} of {len(flight.views)}")
        started = time.perf_counter()
        session.set_view(view)
        picture = session.render()
        seconds = time.perf_counter() - started
        surfaces = see(view, rays, frame.origin, near.normal, owner)
        value = 255.0 * metrics.encode_srgb(_diffuse(picture)) @ metrics.LUMA
        camera = np.rint(picture.correspondence[..., 0]).astype(np.int64)
        now = Frame(view, surfaces, value, camera)
        change = None if before is None else flicker(before, now)
        found = seams(now)
        rows.append(_row(picture, found, change, seconds))
        nothing = np.zeros(value.shape, dtype=np.float32)
        shown.append(
            Shown(
                metrics.encode_srgb(picture.combined[..., :3]).astype(np.float16),  # type: ignore[arg-type]
                correspondence_colors(picture.correspondence).astype(np.float16),  # type: ignore[arg-type]
                found.picture,
                nothing if change is None else change.picture,
            )
        )
        before = now
    _leave(args, flight, rows, shown, len(store.manifest.cameras))
    progress(1.0, f"{args.frames} frames flown")


def _baked(scene: Any, geometry: Any, args: argparse.Namespace, progress: Progress) -> Any:
    """The scene's cache in the folder, baked if it is not there yet."""
    from addon.baking import Baking
    from addon.caching.bake import BakeSettings
    from tools.cache_check import check_cache

    cache = args.folder / "cache"
    settings = BakeSettings(args.preset, resume=True, overwrite=True)
    Baking(scene, geometry, cache, settings, anew=(cache / "manifest.json").is_file()).run(
        (), progress
    )
    return check_cache(geometry, cache, int(scene.frame_current))


def _session(arrays: Any, store: Any) -> Any:
    """One that shows the lights' light alone, from their centres and without shadows.

    What is left depends on what the caching cameras hold, and on nothing else.
    """
    from addon.relight.session import RelightSession
    from tools.gpu_context import open_gpu

    open_gpu()
    session = RelightSession(arrays.geometry, store, 1, split_lobes=True, mesh_lights=False)
    session.set_lights([replace(light, use_shadow=False) for light in arrays.lights])
    session.set_world(None)
    return session


def _diffuse(picture: Any) -> NDArray[np.float32]:
    """(H, W, 3): what all lights' diffuse lobes scatter."""
    parts = [lobes["diffuse"] for lobes in picture.lobes.values()]
    if not parts:
        raise InputError("the scene has no light of its own; add a lamp")
    return np.asarray(np.sum(parts, axis=0), dtype=np.float32)


def _row(picture: Any, found: Seams, change: Flicker | None, seconds: float) -> dict[str, Any]:
    """A frame's figures."""
    row = {
        "holes": picture.coverage.hole_fraction,
        "open": picture.coverage.open_fraction,
        "seconds": seconds,
        "seams": _numbers(found),
        "flicker": None,
    }
    if change is not None:
        row["flicker"] = {**_numbers(change), "excess": change.excess}
    return row


def _numbers(found: Seams | Flicker) -> dict[str, float]:
    return {name: value for name, value in vars(found).items() if name != "picture"}


# The sheet's rows: a heading, and what of a frame's figures is the greatest there.
WORST = {
    "Most holes": lambda row: row["holes"],
    "Most open after filling": lambda row: row["open"],
    "Most steps across seams": lambda row: (
        row["seams"]["share"] * (row["seams"]["step"] - row["seams"]["beside"])
    ),
    "Most flicker": lambda row: 0.0 if row["flicker"] is None else row["flicker"]["excess"],
    "Largest changes": lambda row: 0.0 if row["flicker"] is None else row["flicker"]["worst"],
}


def _leave(
    args: argparse.Namespace,
    flight: Flight,
    rows: list[dict[str, Any]],
    shown: list[Shown],
    cameras: int,
) -> None:
    sheet = []
    for heading, of in WORST.items():
        number = int(np.argmax([of(row) for row in rows]))
        row, picture = rows[number], shown[number]
        found, change = row["seams"], row["flicker"] or {"switched": 0.0, "worst": 0.0}
        steps, levels = (
            CHANGE_GAIN * values[..., None].repeat(3, axis=-1) / 255.0
            for values in (picture.steps, picture.change)
        )
        cells = [
            Cell(picture.picture, "Lights without shadows",
                 f"{100.0 * row['holes']:.2f} % holes, {100.0 * row['open']:.2f} % open"),
            Cell(picture.cameras, "Correspondence map", f"{100.0 * found['share']:.2f} % seams"),
            Cell(steps, f"Steps across seams, {CHANGE_GAIN:.0f} times",
                 f"{found['step']:.2f} levels, beside them {found['beside']:.2f}"),
            Cell(levels, f"Change since the frame before, {CHANGE_GAIN:.0f} times",
                 f"{100.0 * change['switched']:.2f} % switched, 99 % below "
                 f"{change['worst']:.1f} levels"),
        ]  # fmt: skip
        sheet.append(Row(f"{heading}: frame {number + 1}", cells))
    subtitle = f"{args.frames} frames, {flight.length:.2f} m, {cameras} caching cameras"
    write_sheet(args.folder / "sheet.png", f"A flight through {args.scene.stem}", subtitle, sheet)
    report = {
        "scene": args.scene.stem,
        "preset": args.preset,
        "size": list(args.size),
        "cameras": cameras,
        "length": flight.length,
        "left_out": list(flight.left_out),
        "frames": rows,
    }
    (args.folder / "flight.json").write_text(to_json(report) + "\n", encoding="utf-8")


def main() -> int:
    """0; 1 when it was stopped; 2 for what cannot be used."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.flight_run")
    parser.add_argument("scene", type=Path)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--frames", type=positive, required=True)
    parser.add_argument("--size", type=size, required=True)
    parser.add_argument("--preset", choices=tuple(PRESETS), required=True)
    args = parser.parse_args()
    try:
        with stop_signals():
            args.folder.mkdir(parents=True, exist_ok=True)
            run(args, stoppable(progress_on(sys.stderr)))
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except (Cancelled, KeyboardInterrupt):
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
