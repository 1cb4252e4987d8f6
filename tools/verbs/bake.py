# SPDX-License-Identifier: GPL-3.0-or-later
"""`relume bake SCENE.blend`: deep framebuffers into a cache."""

from __future__ import annotations

import argparse
from typing import Any

from addon.bake_arguments import add_bake_arguments, bake_settings
from addon.place_arguments import shot_choice
from addon.progress import Progress, part_of
from addon.writable import require_folder

from . import arguments

NAME = "bake"
HELP = "Bake SCENE.blend into a cache folder, placing the caching cameras first if need be."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's arguments."""
    arguments.add_scene(parser)
    add_bake_arguments(parser)


def run(args: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Bake."""
    require_folder(args.cache)

    from ..scene_file import load_blender, open_scene

    load_blender()
    from addon.baking import Baking
    from addon.camplace.cameras_file import read_cameras

    from ..relit import read_scene

    cameras = read_cameras(args.placement) if args.placement is not None else ()
    progress(0.0, f"opening {args.scene.name}")
    scene = open_scene(args.scene)
    progress(0.02, "reading the scene")
    arrays = read_scene(scene)
    settings = bake_settings(args)
    step = part_of(progress, 0.05, 1.0)
    said: list[str] = []
    baking = Baking(
        scene,
        arrays.geometry,
        args.cache,
        settings,
        shot=shot_choice(args),
        anew=args.place_anew,
        say=said.append,
    )
    report = baking.run(cameras, step)
    warnings = [*arrays.warnings, *said, *report.notes, *report.approximations]
    return {"cache": str(args.cache), **report.to_json(), "warnings": warnings}


def describe(report: dict[str, Any]) -> str:
    """The result for a person."""
    seconds = sum(report["seconds"].values())
    frames = ""
    if report["frames"]:
        pictures = sum(len(cameras) for cameras in report["frames"].values())
        frames = f"{len(report['frames'])} more frames with {pictures} pictures of their own, "
    channels = report["channels"]["stored"]["channels"]
    return (
        f"{report['cache']}: {report['baked']} of {report['cameras']} cameras baked, "
        f"{report['kept']} kept, {frames}{report['texels'] / 1e6:.1f} million texels of "
        f"{channels} channels, {report['stored_bytes'] / 1e6:.0f} MB, "
        f"{seconds:.1f} s"
    )
