# SPDX-License-Identifier: GPL-3.0-or-later
"""`relume evaluate SCENE.blend`: relit views held against Cycles."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from addon.argument_types import names, positive
from addon.preset_argument import add_preset
from addon.progress import Progress, part_of
from addon.writable import require_folder

from ..output import to_json
from ..unique_names import folder_names
from . import arguments

if TYPE_CHECKING:
    from ..evaluation import EvaluatedView

NAME = "evaluate"
HELP = (
    "Relight views of SCENE.blend, render the same with Cycles (direct light only), and write "
    "pictures and figures to a folder. Places cameras and bakes first where there is no cache."
)
# Of each light and pixel, to begin with; powers of two, which Cycles' sampler spreads best.
REFERENCE_SAMPLES = 16
DOUBLINGS = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's arguments."""
    arguments.add_scene(parser)
    parser.add_argument("--cache", type=Path, metavar="DIR", help="default: cache in --out")
    parser.add_argument("--out", type=Path, metavar="DIR", required=True)
    parser.add_argument(
        "--cameras", type=names, metavar="A,B", help="default: all of the scene's cameras"
    )
    parser.add_argument(
        "--lights", type=Path, metavar="EDITS.json", help="changes to the lights, by their names"
    )
    arguments.add_view(parser)
    arguments.add_filling(parser)
    parser.add_argument(
        "--reference-samples", type=positive, default=REFERENCE_SAMPLES, metavar="N",
        help="Cycles' samples of each pixel and light (default: %(default)s); they are doubled "
        "while the reference's noise is too high for the error, "
        f"at most to {2**DOUBLINGS} times as many",
    )  # fmt: skip
    add_preset(parser, None)


def run(args: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Relight, render, measure and write the report."""
    require_folder(args.out)
    if args.cache is not None:
        require_folder(args.cache)

    from ..scene_file import load_blender, open_scene

    load_blender()
    from addon.baking import Baking
    from addon.caching.bake import BakeSettings
    from addon.caching.bake_settings import cached_preset
    from addon.caching.presets import DEFAULT_PRESET
    from addon.relight.edits.edits_file import applied_edits, read_edits

    from .. import evaluation
    from ..filling import Filling
    from ..relit import (
        camera_names,
        open_session,
        read_scene,
        read_views,
        require_light,
        unmixed,
    )

    edits = read_edits(args.lights) if args.lights is not None else {}
    progress(0.0, f"opening {args.scene.name}")
    scene = open_scene(args.scene)
    if args.frame is not None:
        scene.frame_set(args.frame)
    wanted = args.cameras or camera_names(scene)
    cache = args.cache or args.out / "cache"
    with applied_edits(scene, edits):
        arrays = unmixed(read_scene(scene))
        shown = read_views(scene, wanted, args.size)
    require_light(scene, arrays)
    cached = cached_preset(cache)
    frames = () if args.frame is None else (args.frame,)
    settings = BakeSettings(args.preset or cached or DEFAULT_PRESET, resume=True, frames=frames)
    # A cache is evaluated as it was baked, whatever cameras the scene shows by now.
    said: list[str] = []
    baking = Baking(
        scene, arrays.geometry, cache, settings, anew=cached is not None, say=said.append
    )
    baked = baking.run((), part_of(progress, 0.02, 0.4))
    folders = folder_names([view.name for view in shown], taken=("cache",))
    with applied_edits(scene, edits):
        session = open_session(arrays, cache, args.samples, shadows=args.shadows)
        views = []
        with Filling(scene, arrays, cache, session, **arguments.filling(args)) as filling:
            for number, view in enumerate(shown):
                ends = [0.4 + 0.1 * (number + i) / len(shown) for i in (0, 1)]
                step = part_of(progress, *ends)
                folder = args.out / folders[number]
                shot = evaluation.Shot(view.name, scene.frame_current, view, folder)
                views.append(evaluation.relight_view(session, shot, step, filling))
                views[-1].write_relit(scene)
        _prepare(scene, args.size)
        evaluation.measure_all(
            scene, views, args.reference_samples, part_of(progress, 0.5, 0.98), DOUBLINGS
        )
    sheet = args.out / "contact_sheet.png"
    _write_sheet(sheet, f"{args.scene.name}, {len(arrays.geometry):,} triangles", views)
    report = {
        "scene": str(args.scene),
        "cache": str(cache),
        "triangles": len(arrays.geometry),
        "bake": baked.to_json(),
        "filled": filling.report(),
        "warnings": [
            *arrays.warnings,
            *said,
            *filling.notes,
            *baked.notes,
            *baked.approximations,
        ],
        "views": [view.report for view in views],
        "contact_sheet": str(sheet),
    }
    (args.out / "report.json").write_text(to_json(report) + "\n", encoding="utf-8")
    progress(1.0, f"wrote {args.out}")
    return report


def _prepare(scene: Any, size: tuple[int, int] | None) -> None:
    """Set a scene up for its reference, at its own size or another."""
    from ..reference import prepare

    prepare(scene)
    if size is not None:
        scene.render.resolution_x, scene.render.resolution_y = size
        scene.render.resolution_percentage = 100


def _write_sheet(path: Path, subtitle: str, views: Sequence[EvaluatedView]) -> None:
    from ..contact_sheet import write_sheet

    rows = [view.row(view.shot.name) for view in views]
    write_sheet(path, "Relume against Cycles", subtitle, rows)


def describe(report: dict[str, Any]) -> str:
    """The result for a person."""
    from ..evaluation import describe_views

    return f"{describe_views(report['views'])}\nsee {report['contact_sheet']}"
