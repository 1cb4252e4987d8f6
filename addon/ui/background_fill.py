# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes a view's holes in a background Blender, telling its progress in JSON."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from ..caching.store import CacheStore
from ..camplace.cameras_file import read_cameras
from ..hole_bake import bake_holes
from ..json_lines import run_told
from ..progress import Progress
from ..scene.depsgraph_reader import with_render_depsgraph
from ..scene.geometry_reader import read_geometry


def main(argv: Sequence[str]) -> int:
    """Bake the cameras of a file for the open file's scene, into the temporary pictures beside a
    cache, telling of it as `run_told` does; returns the exit status."""
    parser = argparse.ArgumentParser(prog="fill")
    parser.add_argument("--cache", type=Path, required=True)
    parser.add_argument("--cameras", type=Path, required=True)
    args = parser.parse_args(argv)
    return run_told(lambda progress: _fill(args, progress))


def _fill(args: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    cameras = read_cameras(args.cameras)
    scene = bpy.context.scene
    progress(0.0, "Reading the scene")
    geometry = with_render_depsgraph(scene, read_geometry)
    cache = CacheStore.open(args.cache)
    return {"numbers": list(bake_holes(scene, geometry, cache, cameras, progress))}
