# SPDX-License-Identifier: GPL-3.0-or-later
"""`relume place SCENE.blend`: where the caching cameras go."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from addon.errors import InputError
from addon.place_arguments import add_place_arguments, placement_settings, shot_choice
from addon.progress import Progress, part_of
from addon.scene.shot import describe_shot
from addon.writable import require_file

from . import arguments

NAME = "place"
HELP = "Place caching cameras for the views of SCENE.blend."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's arguments."""
    arguments.add_scene(parser)
    parser.add_argument("--out", type=Path, metavar="CAMERAS.json", help="write the cameras here")
    parser.add_argument("--show", type=Path, metavar="PICTURE.png", help="draw them in the scene")
    parser.add_argument(
        "--weights", type=Path, metavar="WEIGHTS.json",
        help="how much objects and materials matter, 0 to 1, by their names",
    )  # fmt: skip
    add_place_arguments(parser)


def run(args: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Place, and write what was asked for."""
    _check_places(args.out, args.show)
    settings = placement_settings(args, args.box)

    from ..scene_file import load_blender, open_scene

    load_blender()
    from addon.camplace.cameras_file import read_cameras, write_cameras
    from addon.camplace.place import place_cameras
    from addon.scene.shot_reader import read_shot

    from ..relit import read_scene
    from ..weights import read_weights, with_weights

    weights = read_weights(args.weights) if args.weights is not None else {}
    earlier = read_cameras(args.keep_from) if args.keep_from is not None else ()
    progress(0.0, f"opening {args.scene.name}")
    scene = open_scene(args.scene)
    progress(0.05, "reading the scene")
    geometry = with_weights(read_scene(scene).geometry, weights)
    views = read_shot(scene, shot_choice(args))
    settings = replace(settings, bounds=_box(args, scene))
    placement = place_cameras(
        geometry, views, settings, part_of(progress, 0.1, 0.9), earlier=earlier
    )
    written = []
    if args.out is not None:
        write_cameras(args.out, placement.cameras)
        written.append(str(args.out))
    if args.show is not None:
        from ..place_picture import draw_placement

        progress(0.92, "drawing the cameras")
        draw_placement(geometry, placement, args.show, views)
        written.append(str(args.show))
    progress(1.0, "placed")
    return {
        "cameras": [camera.to_json() for camera in placement.cameras],
        "primaries": len({c.source for c in placement.cameras if c.kind == "CUBE_FACE"}),
        "secondaries": sum(c.kind == "PERSPECTIVE" for c in placement.cameras),
        "shot": [view.name for view in views],
        "box": np.asarray(placement.box).tolist(),
        **placement.report(),
        "written": written,
        "warnings": [*geometry.warnings, *placement.warnings],
    }


def _box(args: argparse.Namespace, scene: Any) -> NDArray[np.float64] | None:
    """The box of interest that was asked for."""
    if args.box_object is None:
        return cast("NDArray[np.float64] | None", args.box)
    import bpy

    from addon.scene.box_reader import find_box

    return find_box(bpy.context.evaluated_depsgraph_get(), scene, args.box_object)


def _check_places(out: Path | None, show: Path | None) -> None:
    """Raises InputError when a result could not be written, before the work that it takes."""
    if show is not None and show.suffix.lower() != ".png":
        raise InputError(f"{show} is not a .png file; name one.")
    for path in (out, show):
        if path is not None:
            require_file(path, in_new_folder=False)


def describe(report: dict[str, Any]) -> str:
    """The result for a person."""
    summary = (
        f"{len(report['cameras'])} caching cameras for {describe_shot(report['shot'])}: "
        f"{report['primaries']} primary (six faces each at most), {report['secondaries']} "
        f"secondary, {report['texels'] / 1e6:.1f} million texels"
    )
    if report["kept"]:
        summary += f"; {report['kept']} kept from before"
    lines = [summary]
    moved = "what the views, and views moved by up to a tenth of their distance, see"
    for key, what in (("by_view", moved), ("by_area", "the surface in the box")):
        seen, well = report["seen"][key], report["well_seen"][key]
        if not np.isnan(seen):
            lines.append(f"of {what}: {100.0 * seen:.1f} % seen, {100.0 * well:.1f} % well")
    return "\n".join([*lines, *(f"wrote {path}" for path in report["written"])])
