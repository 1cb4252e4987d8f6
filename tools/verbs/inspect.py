# SPDX-License-Identifier: GPL-3.0-or-later
"""`relume inspect CACHE`: what a cache holds, in figures and pictures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from addon.bake_arguments import camera_numbers
from addon.caching.channels import CHANNEL_BY_NAME
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.plan_report import float32_bytes
from addon.caching.store import CacheStore
from addon.errors import InputError
from addon.progress import Progress
from addon.writable import require_file

NAME = "inspect"
HELP = "Say what CACHE holds, and draw every channel of every caching camera on one sheet."

# Pixels of one picture on the sheet: a dozen beside each other still fit a large screen.
COLUMN = 180


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's arguments."""
    parser.add_argument("cache", type=Path, metavar="CACHE", help="the cache folder")
    parser.add_argument("--out", type=Path, metavar="SHEET.png", help="draw the channels here")
    parser.add_argument(
        "--cameras", type=camera_numbers, metavar="0-7", help="these alone (default: all)"
    )


def run(args: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Read all that is asked for, which also shows whether it is whole."""
    if args.out is not None:
        if args.out.suffix.lower() != ".png":
            raise InputError(f"{args.out} is not a .png file; name one.")
        require_file(args.out, in_new_folder=False)
    store = CacheStore.open(args.cache)
    wanted = _wanted(store, args.cameras)
    rows, cameras = [], []
    raw = 0
    for index, number in enumerate(wanted):
        progress(index / max(len(wanted), 1), f"reading camera {number}")
        framebuffer = store.read_camera(number)
        raw += framebuffer.raw_bytes
        cameras.append(_figures(store, framebuffer))
        if args.out is not None:
            rows += [_row(picture, n) for n, picture in enumerate(framebuffer.pictures)]
    stored = sum(store.manifest.finished[number].size for number in wanted)
    texels = sum(camera["pictures"] * camera["resolution"] ** 2 for camera in cameras)
    written = []
    if rows:
        from ..contact_sheet import write_sheet

        progress(0.95, "drawing the sheet")
        subtitle = f"{len(wanted)} cameras, {texels / 1e6:.1f} million texels"
        write_sheet(args.out, str(args.cache), subtitle, rows, column=COLUMN)
        written.append(str(args.out))
    progress(1.0, "inspected")
    plan = store.plan
    return {
        "cache": str(args.cache),
        "settings": dict(store.manifest.settings),
        "cameras": cameras,
        "unfinished": [c.id for c in store.manifest.cameras if c.id not in store.manifest.finished],
        "texels": texels,
        "channels": list(plan.stored),
        "constants": {name: list(value) for name, value in plan.constants.items()},
        "material_constants": sorted(plan.material_constants),
        "same": dict(plan.same),
        "lobes": plan.lobes,
        "materials": list(plan.material_names),
        "raw_bytes": raw,
        "stored_bytes": stored,
        "all_channels_bytes": texels * float32_bytes(plan),
        "written": written,
        "warnings": [str(item) for item in plan.approximations],
    }


def _wanted(store: CacheStore, only: frozenset[int] | None) -> list[int]:
    """The finished cameras that were asked for, in their order."""
    finished = [camera.id for camera in store.cameras]
    if only is None:
        return finished
    missing = sorted(only - set(finished))
    if missing:
        raise InputError(
            f"{store.folder} has no finished camera {missing[0]}; it has "
            f"{', '.join(map(str, finished)) or 'none'}"
        )
    return [number for number in finished if number in only]


def _figures(store: CacheStore, framebuffer: DeepFramebuffer) -> dict[str, Any]:
    camera = framebuffer.camera
    return {
        "id": camera.id,
        "kind": camera.kind,
        "fov": camera.fov,
        "resolution": camera.resolution,
        "pictures": len(framebuffer.pictures),
        "seen_share": float((framebuffer.channels["depth"] > 0.0).mean()),
        "raw_bytes": framebuffer.raw_bytes,
        "stored_bytes": store.manifest.finished[camera.id].size,
        "float32": sorted(framebuffer.wide),
    }


def _row(framebuffer: DeepFramebuffer, left_out: int) -> Any:
    """A picture with so many sheer layers left out."""
    from ..channel_picture import channel_picture
    from ..contact_sheet import Cell, Row

    camera = framebuffer.camera
    # As many texels as the sheet shows, and a few more to be averaged.
    step = max(1, camera.resolution // (2 * COLUMN))
    hit = framebuffer.channels["depth"][..., 0] > 0.0
    cells = []
    for name, values in framebuffer.channels.items():
        picture, note = channel_picture(CHANNEL_BY_NAME[name], values, hit)
        cells.append(Cell(picture[::step, ::step], name.replace("_", " "), note))
    what = "face of a cube camera" if camera.kind == "CUBE_FACE" else "secondary camera"
    heading = (
        f"{camera.id}: {what}, {np.degrees(camera.fov):.0f} degrees, "
        f"{camera.resolution} x {camera.resolution} texels"
        f"{f', behind sheer layer {left_out}' if left_out else ''}"
    )
    return Row(heading, cells)


def describe(report: dict[str, Any]) -> str:
    """The result for a person."""
    all_channels = report["all_channels_bytes"]
    saved = all_channels / max(report["stored_bytes"], 1)
    cameras, texels = len(report["cameras"]), report["texels"] / 1e6
    size = f"{report['raw_bytes'] / 1e6:.1f} MB, {report['stored_bytes'] / 1e6:.1f} MB on disk"
    pictures = sum(camera["pictures"] for camera in report["cameras"]) - cameras
    behind = f" with {pictures} pictures behind sheer layers" if pictures else ""
    lines = [
        f"{report['cache']}: {cameras} cameras{behind}, {texels:.1f} million texels",
        f"channels: {', '.join(report['channels'])}",
        f"{size}; all channels in float32: {all_channels / 1e6:.1f} MB, {saved:.1f} times as much",
    ]
    if report["constants"]:
        lines.append(f"constant: {', '.join(report['constants'])}")
    if report["unfinished"]:
        lines.append(f"not yet baked: cameras {', '.join(map(str, report['unfinished']))}")
    return "\n".join([*lines, *(f"wrote {path}" for path in report["written"])])
