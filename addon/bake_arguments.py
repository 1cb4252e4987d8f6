# SPDX-License-Identifier: GPL-3.0-or-later
"""The arguments of a bake, the same for every way to start one."""

from __future__ import annotations

import argparse
from pathlib import Path

from .caching.presets import DEFAULT_PRESET
from .place_arguments import add_shot
from .preset_argument import add_preset

# Far more caching cameras than a cache can have.
LAST_CAMERA = 99_999


def add_bake_arguments(parser: argparse.ArgumentParser) -> None:
    """Where to, how fine, and which cameras."""
    add_cache(parser)
    add_preset(parser, DEFAULT_PRESET)
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
        "--resume", action="store_true", help="keep what an earlier bake has finished"
    )
    parser.add_argument(
        "--overwrite", action="store_true",
        help="replace another scene's cache in the folder; with --resume, also one of other "
        "cameras, of which those that are the same are kept",
    )  # fmt: skip


def add_cache(parser: argparse.ArgumentParser) -> None:
    """The cache folder."""
    parser.add_argument("--cache", type=Path, metavar="DIR", required=True, help="the cache folder")


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
