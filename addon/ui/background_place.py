# SPDX-License-Identifier: GPL-3.0-or-later
"""Places caching cameras in a background Blender, telling its progress in JSON."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from ..camplace.cameras_file import read_cameras, write_cameras
from ..camplace.place import place_cameras
from ..json_lines import run_told
from ..place_arguments import add_place_arguments, placement_settings, shot_choice
from ..progress import Progress
from ..scene.box_reader import find_box
from ..scene.depsgraph_reader import with_render_depsgraph
from ..scene.geometry_reader import read_geometry
from ..scene.shot_reader import read_shot
from ..whole_file import write_errors
from ..writable import require_folder


def main(argv: Sequence[str]) -> int:
    """Place cameras for the open file's scene and save them, telling of it as `run_told` does;
    returns the exit status."""
    parser = argparse.ArgumentParser(prog="place")
    parser.add_argument("--out", type=Path, required=True)
    add_place_arguments(parser)
    args = parser.parse_args(argv)
    return run_told(lambda progress: _place(args, progress))


def _place(args: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    require_folder(args.out.parent)
    scene = bpy.context.scene
    geometry = with_render_depsgraph(scene, read_geometry)
    views = read_shot(scene, shot_choice(args))
    box = args.box
    if args.box_object is not None:
        box = find_box(bpy.context.evaluated_depsgraph_get(), scene, args.box_object)
    settings = placement_settings(args, box)
    earlier = () if args.keep_from is None else read_cameras(args.keep_from)
    placement = place_cameras(geometry, views, settings, progress, earlier=earlier)
    with write_errors(args.out.parent, "choose another folder"):
        args.out.parent.mkdir(parents=True, exist_ok=True)
    write_cameras(args.out, placement.cameras)
    shot = [view.name for view in views]
    return {"cameras": len(placement.cameras), "shot": shot, **placement.report()}
