# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments that several verbs share, spelled once."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from addon.camplace.settings import PlacementSettings
from addon.sampling import PICTURE_SAMPLES

# Blender's MAXFRAME; its own first frame is the negative of it.
LAST_FRAME = 1_048_574


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


def add_placement(parser: argparse.ArgumentParser) -> None:
    """The placement's budget."""
    default = PlacementSettings()
    for name, what in (("primaries", "primary cameras, of six faces each"),
                       ("secondaries", "secondary cameras")):  # fmt: skip
        parser.add_argument(
            f"--{name}", type=count, default=getattr(default, name), metavar="N",
            help=f"most {what} (default: %(default)s)",
        )  # fmt: skip
    parser.add_argument(
        "--seed", type=count, default=default.seed, metavar="N", help="default: %(default)s"
    )


def placement_settings(
    args: argparse.Namespace, bounds: NDArray[np.float64] | None = None
) -> PlacementSettings:
    """What `add_placement`'s arguments say."""
    return PlacementSettings(
        seed=args.seed, primaries=args.primaries, secondaries=args.secondaries, bounds=bounds
    )


def size(text: str) -> tuple[int, int]:
    """A WxH argument, such as 640x480."""
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a size such as 640x480") from None
    if width < 1 or height < 1:
        raise argparse.ArgumentTypeError(f"'{text}' has no pixels")
    return width, height


def count(text: str) -> int:
    """A whole number of at least 0."""
    try:
        number = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number") from None
    if number < 0:
        raise argparse.ArgumentTypeError(f"{number} is less than 0")
    return number


def positive(text: str) -> int:
    """A whole number of at least 1."""
    number = count(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number} is less than 1")
    return number


def frame(text: str) -> int:
    """A frame number that Blender can have."""
    try:
        number = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number") from None
    if abs(number) > LAST_FRAME:
        raise argparse.ArgumentTypeError(f"there are frames to {LAST_FRAME:,} only, not {text}")
    return number


def names(text: str) -> tuple[str, ...]:
    """Names between commas."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


def box(text: str) -> NDArray[np.float64]:
    """Six numbers between commas: a (2, 3) box."""
    try:
        corners = np.array([float(part) for part in text.split(",")]).reshape(2, 3)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not six numbers X,Y,Z,X,Y,Z") from None
    return corners
