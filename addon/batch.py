# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a cache for the open .blend: places caching cameras and bakes them.

`tools/bake_cache.py` and the Blender panel's background process both end here.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import bpy

from .bake_arguments import add_bake_arguments, bake_settings
from .baking import Baking
from .caching.bake import BakeReport
from .camplace.cameras_file import read_cameras
from .json_lines import run_told
from .place_arguments import shot_choice
from .progress import Progress
from .scene.depsgraph_reader import with_render_depsgraph
from .scene.geometry_reader import read_geometry
from .writable import require_folder


def main(argv: Sequence[str]) -> int:
    """Bake the open file, telling of it as `run_told` does; returns the exit status."""
    parser = argparse.ArgumentParser(prog="bake_cache")
    add_bake_arguments(parser)
    args = parser.parse_args(argv)
    return run_told(lambda progress: _bake(args, progress).to_json())


def _bake(args: argparse.Namespace, progress: Progress) -> BakeReport:
    require_folder(args.cache)
    scene = bpy.context.scene
    progress(0.0, "Reading the scene")
    cameras = () if args.placement is None else read_cameras(args.placement)
    geometry = with_render_depsgraph(scene, read_geometry)
    for warning in geometry.warnings:
        sys.stderr.write(f"relume: {warning}\n")
    settings = bake_settings(args)
    baking = Baking(
        scene,
        geometry,
        args.cache,
        settings,
        shot=shot_choice(args),
        anew=args.place_anew,
        say=lambda sentence: print(f"relume: {sentence}", file=sys.stderr, flush=True),
    )
    report = baking.run(cameras, progress)
    for line in (*report.notes, *report.approximations):
        sys.stderr.write(f"relume: {line}\n")
    return report
