# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast a camera move is, by caching cameras and triangles, beside EEVEE and Cycles.

    python -m benchmarks.corrmap [--quick] [--parts cameras triangles]

A scene of heads is made and baked. Its camera then moves in a running session of Relume, and the
median time until the first full picture is printed, with what each pass takes of it:

* by the number of caching cameras, all of which are near what the view sees;
* by the number of triangles, beside EEVEE's one-sample render and Cycles' first sample after the
  same moves. These have what they keep between renders; Cycles has direct light only.

Every step is a process of its own, one after the other.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from .corrmap_figures import describe_moves, growth, move_bounds
from .relight import run_step

PARTS = ("cameras", "triangles")

LIGHTS = 4


def main() -> int:
    """Print the tables; the exit status is 1 where a bound is missed."""
    args = _arguments()
    report: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="relume-bench-", dir=args.scratch) as folder:
        at = Path(folder)
        if "triangles" in args.parts:
            small = at / "placed.blend"
            run_step("relight_run", "scene", 14_000, LIGHTS, small)
            run_step("caching_run", "place", small, "draft", at / "placed.json")
            report["triangles"] = [_triangles(args, at, count) for count in args.triangles]
        if "cameras" in args.parts:
            report["cameras"] = _cameras(args, at)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    args.out.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    missed = False
    for rows in report.values():
        print(describe_moves(rows) + "\n")
    if "cameras" in report:
        print(f"the most cameras take {growth(report['cameras']):.2f} times as long as the fewest")
    for bound in move_bounds(report.get("triangles", ()), args.judged):
        missed |= not bound.met
        print(bound)
    print(f"wrote {args.out}")
    return int(missed)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.corrmap",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--cameras", type=int, nargs="+", default=(9, 27, 81, 300), metavar="N")
    parser.add_argument("--camera-triangles", type=int, default=140_000, metavar="N",
                        help="of the scene in which cameras are counted")  # fmt: skip
    parser.add_argument("--resolution", type=int, default=128, metavar="N",
                        help="of the cameras that are counted")  # fmt: skip
    parser.add_argument("--triangles", type=int, nargs="+", metavar="N",
                        default=(14_000, 140_000, 1_400_000, 14_000_000))  # fmt: skip
    parser.add_argument("--judged", type=int, default=1_400_000, metavar="N",
                        help="triangles at which EEVEE's time is a bound")  # fmt: skip
    parser.add_argument("--largest-beside", type=int, default=1_400_000, metavar="N",
                        help="most triangles that other renderers are given")  # fmt: skip
    parser.add_argument("--size", default="640x480", metavar="WxH")
    parser.add_argument("--runs", type=int, default=11, metavar="N", help="moves to time")
    parser.add_argument("--quick", action="store_true",
                        help="small scenes and few moves, to see that it runs")  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("out/corrmap.json"), metavar="FILE.json")
    parser.add_argument("--scratch", type=Path, metavar="FOLDER", help="for scenes and caches")
    args = parser.parse_args()
    if args.quick:
        args.cameras, args.camera_triangles, args.resolution = (9, 27), 14_000, 64
        args.triangles, args.judged = (14_000,), 0
        args.size, args.runs = "320x240", 3
    return args


def _triangles(args: argparse.Namespace, at: Path, triangles: int) -> dict[str, Any]:
    """Moves in a scene of so many triangles, with the placed cameras."""
    scene, cache = _baked(at, triangles, at / "placed.json")
    row = run_step("corrmap_run", "moves", scene, cache, args.size, args.runs, 0)
    if triangles <= args.largest_beside:
        renders = max(args.runs // 4, 1)
        for name in ("eevee", "cycles"):
            row[f"{name}_s"] = run_step("corrmap_run", name, scene, args.size, renders)["seconds"]
    return _told({"asked": triangles, **row})


def _cameras(args: argparse.Namespace, at: Path) -> list[dict[str, Any]]:
    """Moves with more and more cameras of one cache."""
    spread = at / "spread.json"
    scene = at / "cameras.blend"
    run_step("relight_run", "scene", args.camera_triangles, LIGHTS, scene)
    run_step("corrmap_run", "cameras", scene, max(args.cameras), args.resolution, spread)
    cache = at / "cameras.relume"
    run_step("caching_run", "bake", scene, "draft", spread, cache)
    return [
        _told(run_step("corrmap_run", "moves", scene, cache, args.size, args.runs, count))
        for count in args.cameras
    ]


def _told(row: dict[str, Any]) -> dict[str, Any]:
    """Say it at once: a run takes long, and may end early."""
    print(json.dumps(row), file=sys.stderr, flush=True)
    return row


def _baked(at: Path, triangles: int, cameras: Path) -> tuple[Path, Path]:
    """A scene and its cache."""
    scene, cache = at / f"{triangles}.blend", at / f"{triangles}.relume"
    run_step("relight_run", "scene", triangles, LIGHTS, scene)
    run_step("caching_run", "bake", scene, "draft", cameras, cache)
    return scene, cache


if __name__ == "__main__":
    sys.exit(main())
