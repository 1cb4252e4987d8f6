# SPDX-License-Identifier: GPL-3.0-or-later
"""Places caching cameras in a background Blender, telling its progress in JSON."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from ..camplace.cameras_file import write_cameras
from ..camplace.place import place_cameras
from ..camplace.settings import PlacementSettings
from ..errors import InputError
from ..scene.depsgraph_reader import with_render_depsgraph
from ..scene.geometry_reader import read_geometry
from ..scene.shot_reader import read_shot


def main(argv: Sequence[str]) -> int:
    """Place cameras for the open file's scene and save them.

    Prints {"progress": share, "message": text} as the work goes on, and {"result": {...}} or
    {"error": text} at its end. Returns the exit status: 0, or 2 for input that cannot be used.
    """
    parser = argparse.ArgumentParser(prog="place")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--primaries", type=int, required=True)
    parser.add_argument("--secondaries", type=int, required=True)
    args = parser.parse_args(argv)
    try:
        scene = bpy.context.scene
        geometry = with_render_depsgraph(scene, read_geometry)
        views = read_shot(scene)
        settings = PlacementSettings(primaries=args.primaries, secondaries=args.secondaries)
        placement = place_cameras(geometry, views, settings, _progress)
        args.out.parent.mkdir(parents=True, exist_ok=True)
        write_cameras(args.out, placement.cameras)
    except (InputError, OSError) as error:
        _say({"error": str(error)})
        return 2
    _say({"result": {"cameras": len(placement.cameras)}})
    return 0


def _progress(fraction: float, message: str) -> None:
    _say({"progress": fraction, "message": message})


def _say(event: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(event) + "\n")
    sys.stdout.flush()
