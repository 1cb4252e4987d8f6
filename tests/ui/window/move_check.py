# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves the real window's view and tells what it showed meanwhile, at each frame rate.

    python -m tests.ui.window.move_check SCENE.blend --cache DIR --out DIR --blender "blender" \
        [--rates 60 30 20 FULL] [--samples 4]

As `window_check`, it builds and installs the extension; then it orbits the view and lets it stand
still. Prints for each frame rate how long drawings took while the view moved, at which resolution,
and the times to the first, the full and the last picture after that; screenshots and move.json
stay in --out.
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import sys
from pathlib import Path
from statistics import median
from typing import Any

from tools.build_extension import main as build_extension

from .window_check import WINDOW

DRIVER = Path(__file__).with_name("drive_move.py")
RATES = ("60", "30", "20", "FULL")
# Pictures in which a moving view's resolution settles.
SETTLING = 8


def describe(rate: str, found: dict[str, Any]) -> str:
    """What happened at one frame rate, in a line."""
    moving = [d for d in found["moving"] if not d["compiling"]][SETTLING:]
    if not moving:
        return f"{rate}: it was not drawn"
    took = [1000.0 * d["seconds"] for d in moving]
    divisors = sorted({d["divisor"] for d in moving})
    last = found["after"][-1] if found["after"] else moving[-1]
    steps = ", ".join(
        f"{name} {1000.0 * last[name]:.0f} ms"
        for name in ("first", "full", "last")
        if last[name] is not None
    )
    return (
        f"{rate}: {len(moving)} drawings, median {median(took):.0f} ms, most {max(took):.0f} ms, "
        f"a pixel for {', '.join(f'{d}x{d}' for d in divisors)}; then {steps}"
    )


def main(argv: list[str] | None = None) -> int:
    """0; 1 when Blender could not be driven."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("--cache", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--blender", default="blender")
    parser.add_argument("--backend", choices=("opengl", "vulkan"), default="opengl")
    parser.add_argument("--rates", nargs="+", choices=RATES, default=list(RATES))
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--patience", type=float, default=100.0, help="seconds for a picture")
    args = parser.parse_args(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / "failed.txt").unlink(missing_ok=True)
    if build_extension(["--out", str(args.out / "zip")]) != 0:
        return 1
    request = {
        "out": str(args.out.resolve()),
        "zip": str(next((args.out / "zip").glob("*.zip")).resolve()),
        "blend": str(args.scene.resolve()),
        "cache": str(args.cache.resolve()),
        "samples": args.samples,
        "patience_s": args.patience,
        "rates": args.rates,
    }
    path = args.out / "request.json"
    path.write_text(json.dumps(request), encoding="utf-8")
    command = [*shlex.split(args.blender), "--gpu-backend", args.backend]
    command += ["--window-geometry", *WINDOW, "--python", str(DRIVER), "--", str(path.resolve())]
    subprocess.run(command, check=True, timeout=(len(args.rates) + 4.0) * args.patience)
    failed = args.out / "failed.txt"
    if failed.exists():
        print(failed.read_text(encoding="utf-8"), file=sys.stderr)
        return 1
    report = json.loads((args.out / "move.json").read_text(encoding="utf-8"))
    print("{} x {} pixels".format(*report["size"]))
    for rate, found in report["rates"].items():
        print(describe(rate, found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
