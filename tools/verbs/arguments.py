# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments that several verbs share, spelled once."""

from __future__ import annotations

import argparse
from pathlib import Path

from addon.argument_types import LAST_FRAME, positive
from addon.sampling import PICTURE_SAMPLES


def add_scene(parser: argparse.ArgumentParser) -> None:
    """The .blend file."""
    parser.add_argument("scene", type=Path, metavar="SCENE.blend")


def add_view(parser: argparse.ArgumentParser) -> None:
    """What a view needs beside its camera."""
    parser.add_argument(
        "--size", type=size, metavar="WxH", help="pixels (default: the scene's render size)"
    )
    parser.add_argument("--frame", type=frame, metavar="N", help="the frame (default: the scene's)")
    parser.add_argument(
        "--samples",
        type=positive,
        default=PICTURE_SAMPLES,
        metavar="N",
        help="samples of each pixel (default: %(default)s)",
    )
    parser.add_argument(
        "--shadows",
        choices=("auto", "map", "traced"),
        default="auto",
        help="shadow maps, which are fast on a GPU; a traced ray for each pixel, which is exact; "
        "or whichever is faster here (default: %(default)s)",
    )


def add_filling(parser: argparse.ArgumentParser) -> None:
    """What is done about holes."""
    parser.add_argument(
        "--fill-holes", action="store_true",
        help="have Cycles bake what the cache does not show of the view",
    )  # fmt: skip
    parser.add_argument(
        "--sharpen", action="store_true",
        help="as --fill-holes, and bake what it shows with less than one texel to a pixel",
    )  # fmt: skip
    parser.add_argument(
        "--keep-filled", action="store_true",
        help="as --fill-holes, and keep what was baked in the cache, for other views and later",
    )  # fmt: skip


def filling(args: argparse.Namespace) -> dict[str, bool]:
    """What those arguments choose, for `Filling`."""
    return {
        "fills": args.fill_holes or args.keep_filled or args.sharpen,
        "keeps": args.keep_filled,
        "sharpens": args.sharpen,
    }


def size(text: str) -> tuple[int, int]:
    """A WxH argument, such as 640x480."""
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a size such as 640x480") from None
    if width < 1 or height < 1:
        raise argparse.ArgumentTypeError(f"'{text}' has no pixels")
    return width, height


def frame(text: str) -> int:
    """A frame number that Blender can have."""
    try:
        number = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number") from None
    if abs(number) > LAST_FRAME:
        raise argparse.ArgumentTypeError(f"there are frames to {LAST_FRAME:,} only, not {text}")
    return number
