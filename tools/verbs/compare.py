# SPDX-License-Identifier: GPL-3.0-or-later
"""`relume compare REFERENCE IMAGE`: how far a picture is from its reference."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from addon.progress import Progress
from addon.writable import require_folder

from .. import comparison
from ..picture_file import read_picture

NAME = "compare"
HELP = (
    "Measure IMAGE against REFERENCE, two EXR (scene-linear) or two PNG files: PSNR, FLIP and "
    "relMSE, over the whole picture and away from edges."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's arguments."""
    parser.add_argument("reference", type=Path, metavar="REFERENCE")
    parser.add_argument("image", type=Path, metavar="IMAGE")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="write difference.png, flip.png and edges.png here"
    )


def run(args: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Measure, and write the pictures that were asked for."""
    if args.out is not None:
        require_folder(args.out)
    progress(0.0, "reading the pictures")
    reference, image = read_picture(args.reference), read_picture(args.image)
    progress(0.2, "measuring")
    result = comparison.compare_pictures(reference, image)
    report = dict(result.report)
    if args.out is not None:
        report["pictures"] = result.write(args.out)
    progress(1.0, "measured")
    return report


def describe(report: dict[str, Any]) -> str:
    """The result for a person."""
    return comparison.describe(report)
