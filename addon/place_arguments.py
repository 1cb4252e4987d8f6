# SPDX-License-Identifier: GPL-3.0-or-later
"""The arguments of a placement, the same for every way to start one."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .argument_types import StoreUnless, amount, box, count, names, positive, share
from .caching.presets import DEFAULT_PRESET, PRESETS
from .camplace.settings import PlacementSettings
from .preset_argument import add_preset
from .scene.shot import ShotChoice

_NUMBERS = ("primaries", "secondaries")
_BUDGETS = ("max_pictures", "max_texels", "max_megabytes")
_EITHER = "a budget takes the place of the numbers of cameras"


def add_place_arguments(parser: argparse.ArgumentParser) -> None:
    """What to place cameras for, how many, and from which to start."""
    add_shot(parser)
    _add_interest(parser)
    _add_numbers(parser)
    _add_budgets(parser)
    add_preset(parser, DEFAULT_PRESET)
    default = PlacementSettings()
    parser.add_argument(
        "--view-share", type=share, default=default.view_share, metavar="S",
        help="how much what the views see counts, 0 to 1, against all other surfaces of the set "
        "(default: %(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--keep-from", type=Path, metavar="CAMERAS.json",
        help="cameras of an earlier placement; those that still serve are kept",
    )  # fmt: skip
    parser.add_argument(
        "--seed", type=count, default=default.seed, metavar="N", help="default: %(default)s"
    )


def add_shot(parser: argparse.ArgumentParser) -> None:
    """Whose views cameras are placed for."""
    shot = parser.add_mutually_exclusive_group()
    shot.add_argument(
        "--shot", type=names, metavar="NAME[,NAME...]",
        help="place for the views of these camera objects, over the frame range where they move "
        "(default: of all of them now, and of the active one over the frame range)",
    )  # fmt: skip
    shot.add_argument(
        "--active-camera", action="store_true",
        help="place for the views of the active camera, and of those that timeline markers make "
        "active, over the frames where they are",
    )  # fmt: skip


def _add_interest(parser: argparse.ArgumentParser) -> None:
    interest = parser.add_mutually_exclusive_group()
    interest.add_argument(
        "--box", type=box, metavar="X,Y,Z,X,Y,Z",
        help="lowest and highest corner of what is of interest (default: from the views)",
    )  # fmt: skip
    interest.add_argument(
        "--box-object", metavar="NAME",
        help="an object of the scene, an empty or a mesh, that bounds what is of interest",
    )  # fmt: skip


def _add_numbers(parser: argparse.ArgumentParser) -> None:
    default = PlacementSettings()
    for name, what in zip(
        _NUMBERS, ("primary cameras, of six faces each", "secondary cameras"), strict=True
    ):
        parser.add_argument(
            f"--{name}", type=count, metavar="N", action=StoreUnless, unless=_BUDGETS,
            reason=_EITHER, help=f"most {what} (default: {getattr(default, name)})",
        )  # fmt: skip


def _add_budgets(parser: argparse.ArgumentParser) -> None:
    budgets = parser.add_argument_group(
        "budgets",
        "Where one is given, --primaries and --secondaries do not count: cube faces and single "
        "pictures compete by what they gain for what they cost. Every budget is kept exactly.",
    )
    per_texel = PlacementSettings().bytes_per_texel
    for name, kind, metavar, what in (
        ("pictures", positive, "N", "most pictures; a cube camera is six at most"),
        ("texels", positive, "N", "most texels, over all pictures"),
        ("megabytes", amount, "X",
         f"most megabytes before compression, at {per_texel:g} bytes a texel"),
    ):  # fmt: skip
        budgets.add_argument(
            f"--max-{name}", type=kind, metavar=metavar, action=StoreUnless, unless=_NUMBERS,
            reason=_EITHER, help=what,
        )  # fmt: skip


def shot_choice(args: argparse.Namespace) -> ShotChoice:
    """What `add_shot`'s arguments say."""
    return ShotChoice(names=args.shot or (), active=args.active_camera)


def placement_settings(
    args: argparse.Namespace, bounds: NDArray[np.float64] | None = None
) -> PlacementSettings:
    """What `add_place_arguments`' arguments say.

    Args:
        args: what was parsed.
        bounds: (2, 3), the box of interest, if there is one.

    Raises:
        InputError: a value cannot be used.
    """
    default = PlacementSettings()
    settings = PlacementSettings(
        seed=args.seed,
        primaries=default.primaries if args.primaries is None else args.primaries,
        secondaries=default.secondaries if args.secondaries is None else args.secondaries,
        cameras=args.max_pictures,
        texels=args.max_texels,
        megabytes=args.max_megabytes,
        view_share=args.view_share,
        max_resolution=PRESETS[args.preset].max_resolution,
        bounds=bounds,
    )
    settings.check()
    return settings
