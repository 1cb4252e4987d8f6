# SPDX-License-Identifier: GPL-3.0-or-later
"""The arguments of a bake, the same for every way to start one."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from .argument_types import LAST_FRAME
from .place_arguments import add_shot
from .preset_argument import add_preset

if TYPE_CHECKING:
    from .caching.bake_settings import BakeSettings

# Far more caching cameras than a cache can have.
LAST_CAMERA = 99_999


def add_bake_arguments(parser: argparse.ArgumentParser) -> None:
    """Where to, how fine, and which cameras."""
    add_cache(parser)
    add_preset(parser, None)
    cameras = parser.add_mutually_exclusive_group()
    cameras.add_argument(
        "--placement", type=Path, metavar="CAMERAS.json",
        help="cameras that `relume place --out` wrote (default: the caching cameras in the scene, "
        "as they were edited; without any, with --resume or --cameras the cache's; or placed now)",
    )  # fmt: skip
    cameras.add_argument(
        "--place-anew", action="store_true", help="do not take the caching cameras in the scene"
    )
    add_shot(parser)
    parser.add_argument(
        "--cameras", type=camera_numbers, metavar="0-7", help="bake these alone (default: all)"
    )
    parser.add_argument(
        "--frames", type=frame_numbers, default=(), metavar="1-24",
        help="bake these frames: the first one whole, of the others what changes (default: the "
        "current frame alone)",
    )  # fmt: skip
    parser.add_argument(
        "--resume", action="store_true",
        help="keep what an earlier bake has finished; where the scene changed since, the cameras "
        "that see nothing of it",
    )  # fmt: skip
    parser.add_argument(
        "--overwrite", action="store_true",
        help="replace another scene's cache in the folder; with --resume, also one of other "
        "cameras, of which those that are the same are kept",
    )  # fmt: skip


def bake_settings(args: argparse.Namespace) -> BakeSettings:
    """What those arguments choose.

    Raises:
        InputError: an earlier bake is to be gone on with, and is damaged.
    """
    # Arguments are read before anything that takes its time to load.
    from .caching.bake_settings import BakeSettings, preset_to_bake

    goes_on = args.resume or args.cameras is not None
    preset = preset_to_bake(args.cache, args.preset, goes_on=goes_on, overwrite=args.overwrite)
    return BakeSettings(preset, args.cameras, args.resume, args.overwrite, args.frames)


def add_cache(parser: argparse.ArgumentParser) -> None:
    """The cache folder."""
    parser.add_argument("--cache", type=Path, metavar="DIR", required=True, help="the cache folder")


def frame_numbers(text: str) -> tuple[int, ...]:
    """Frames and ranges of them, such as 1-24,30, in ascending order.

    Raises:
        argparse.ArgumentTypeError: it is anything else, or Blender has no such frame.
    """
    found: set[int] = set()
    for part in text.split(","):
        match = re.fullmatch(r"(-?\d+)(?:-(-?\d+))?", part.strip())
        if match is None:
            raise argparse.ArgumentTypeError(f"'{text}' is not like 1-24 or 1,5,10-20")
        ends = int(match[1]), int(match[2] or match[1])
        if max(abs(end) for end in ends) > LAST_FRAME:
            raise argparse.ArgumentTypeError(f"there are frames to {LAST_FRAME:,} only: '{text}'")
        if ends[1] < ends[0]:
            raise argparse.ArgumentTypeError(f"'{part.strip()}' ends before it begins")
        found.update(range(ends[0], ends[1] + 1))
    return tuple(sorted(found))


def camera_numbers(text: str) -> frozenset[int]:
    """Numbers and ranges, such as 0-7,12.

    Raises:
        argparse.ArgumentTypeError: it is anything else, or names no camera that can be.
    """
    found: set[int] = set()
    try:
        for part in text.split(","):
            first, _, last = part.partition("-")
            ends = int(first), int(last or first)
            if max(ends) > LAST_CAMERA:
                raise argparse.ArgumentTypeError(
                    f"no cache has a camera of a number above {LAST_CAMERA:,}: '{text}'"
                )
            found.update(range(ends[0], ends[1] + 1))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not like 0-7 or 0,3,5-8") from None
    if not found:
        raise argparse.ArgumentTypeError(f"'{text}' names no camera")
    return frozenset(found)
