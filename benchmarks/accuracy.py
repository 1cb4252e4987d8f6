# SPDX-License-Identifier: GPL-3.0-or-later
"""How near Relume's direct light is to Cycles', for every kind of light on every lobe.

    python -m benchmarks.accuracy [--only SETUP ...] [--lights NAME ...] [--fresh]

Each set-up is baked once, relit for each light at several numbers of samples, and rendered by
Cycles with two seeds. Pictures stay in out/accuracy/, so that a run that was stopped goes on and
one with --only or --lights adds its part; Cycles' pictures are used again until --fresh. From all
that is there docs/accuracy.md is written, and a contact sheet to out/accuracy/sheet.png.

All of it takes about an hour on two cores.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import time
from pathlib import Path

from .accuracy_cases import LIGHTS, LOBES
from .accuracy_figures import figures
from .accuracy_run import file_name
from .accuracy_scenes import SETUPS
from .accuracy_table import draw, write

COUNTS = [16, 64]


def main() -> int:
    """Measure what is asked for, and write the page."""
    args = _arguments()
    started = time.monotonic()
    if args.fresh:
        for setup in args.only:
            shutil.rmtree(args.folder / setup, ignore_errors=True)
    for number, setup in enumerate(args.only, start=1):
        missing = [
            light for light in args.lights
            if args.again or not _file(args.folder, setup, light).is_file()
        ]  # fmt: skip
        print(
            f"{setup} ({number} of {len(args.only)}), {len(missing)} lights, after "
            f"{time.monotonic() - started:.0f} s",
            file=sys.stderr, flush=True,
        )  # fmt: skip
        if missing:
            _measure(setup, missing, args.folder)
    files = {
        setup: {
            light: file
            for light in LIGHTS
            if (file := _file(args.folder, setup, light)).is_file()
        }
        for setup in SETUPS
    }  # fmt: skip
    table = {
        setup: {light: figures(file, len(LOBES)) for light, file in lights.items()}
        for setup, lights in files.items()
    }
    write(args.out, table, list(LOBES), COUNTS)
    draw(args.folder / "sheet.png", {s: lights for s, lights in files.items() if lights}, COUNTS[0])
    print(f"{args.out}; {args.folder / 'sheet.png'}")
    return 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.accuracy",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--only", nargs="*", choices=SETUPS, default=list(SETUPS), metavar="SETUP",
                        help=f"of {', '.join(SETUPS)}")  # fmt: skip
    parser.add_argument("--lights", nargs="*", choices=tuple(LIGHTS), default=list(LIGHTS),
                        metavar="NAME", help=f"of {'; '.join(LIGHTS)}")  # fmt: skip
    parser.add_argument("--again", action="store_true",
                        help="relight also what was measured; Cycles' pictures stay")  # fmt: skip
    parser.add_argument("--fresh", action="store_true", help="forget all pictures of --only")
    parser.add_argument("--folder", type=Path, default=Path("out/accuracy"))
    parser.add_argument("--out", type=Path, default=Path("docs/accuracy.md"))
    return parser.parse_args()


def _file(folder: Path, setup: str, light: str) -> Path:
    return folder / setup / f"{file_name(light)}.npz"


def _measure(setup: str, lights: list[str], folder: Path) -> None:
    """In a process of its own, because Blender has one file open in each."""
    command = [
        sys.executable, "-m", "benchmarks.accuracy_run", setup, "--folder", str(folder),
        "--counts", *map(str, COUNTS), "--lights", *lights,
    ]  # fmt: skip
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    sys.exit(main())
