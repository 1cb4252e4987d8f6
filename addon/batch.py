# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a cache for the open .blend: places caching cameras and bakes them.

`tools/bake_cache.py` and the Blender panel's background process both end here.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from .caching.bake import BakeReport, BakeSettings, bake_scene
from .camplace.camera import CachingCamera
from .camplace.cameras_file import read_cameras
from .camplace.place import place_cameras
from .camplace.settings import PlacementSettings
from .errors import InputError
from .progress import Progress
from .scene.depsgraph_reader import with_render_depsgraph
from .scene.geometry import SceneGeometry
from .scene.geometry_reader import read_geometry
from .scene.shot_reader import read_shot


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of a bake, the same for every way to start one."""
    parser.add_argument("--cache", type=Path, required=True, help="the cache's folder")
    parser.add_argument(
        "--preset", choices=("draft", "balanced", "final"), default="balanced", help="how fine"
    )
    parser.add_argument("--cameras", type=camera_ids, help="bake only these, such as 0-7 or 3,5")
    parser.add_argument("--resume", action="store_true", help="keep finished cameras")
    parser.add_argument(
        "--overwrite", action="store_true", help="take the place of another scene's cache"
    )
    parser.add_argument(
        "--placement", type=Path, help="bake the cameras of this file instead of placing them"
    )


def camera_ids(text: str) -> frozenset[int]:
    """Camera ids from "0-7,9". Raises ValueError for anything else."""
    ids: set[int] = set()
    for part in text.split(","):
        first, _, last = part.partition("-")
        ids.update(range(int(first), int(last or first) + 1))
    return frozenset(ids)


def bake_open_file(args: argparse.Namespace, progress: Progress) -> BakeReport:
    """Place and bake the open file's scene.

    Args:
        args: as made by `add_arguments`.
        progress: told how far it is.

    Raises:
        InputError: the scene, the placement or the folder cannot be used.
    """
    scene = bpy.context.scene
    progress(0.0, "Reading the scene")
    geometry: SceneGeometry = with_render_depsgraph(scene, read_geometry)
    for warning in geometry.warnings:
        sys.stderr.write(f"relume: {warning}\n")
    cameras: Sequence[CachingCamera]
    if args.placement is not None:
        cameras = read_cameras(args.placement)
    else:
        placement = place_cameras(
            geometry,
            read_shot(scene),
            PlacementSettings(),
            lambda fraction, message: progress(0.25 * fraction, message),
        )
        cameras = placement.cameras
    start = 0.0 if args.placement is not None else 0.25
    settings = BakeSettings(args.preset, args.cameras, args.resume, args.overwrite)
    report = bake_scene(
        scene,
        geometry,
        cameras,
        args.cache,
        settings,
        lambda fraction, message: progress(start + (1.0 - start) * fraction, message),
    )
    for line in report.approximations:
        sys.stderr.write(f"relume: {line}\n")
    return report


def main(argv: Sequence[str]) -> int:
    """Bake the open file, telling the progress on standard output in lines of JSON.

    Prints {"progress": share, "message": text} as the work goes on, and {"result": {...}} or
    {"error": text} at its end. Returns the exit status: 0, or 2 for input that cannot be used.
    """
    parser = argparse.ArgumentParser(prog="bake_cache")
    add_arguments(parser)
    args = parser.parse_args(argv)
    try:
        report = bake_open_file(args, lambda f, m: _say({"progress": f, "message": m}))
    except InputError as error:
        _say({"error": str(error)})
        sys.stderr.write(f"{error}\n")
        return 2
    _say({"result": report.to_json()})
    return 0


def _say(event: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(event) + "\n")
    sys.stdout.flush()
