# SPDX-License-Identifier: GPL-3.0-or-later
"""How long camera placement takes, how much memory, and how both grow.

    python -m benchmarks.placement [SCENE.blend ...] [--scaling SCENE.blend]

Each scene is read by Blender (timed apart), its surfaces are subdivided to 1.4 million
triangles, and cameras are placed with the paper's budget, 1 primary and 8 secondaries, on two
cores: for all of the file's cameras, and once more for the active one alone. Without a scene the
demo's is built and used. Then one scene, a hall of boxes made by script if none is named, is
subdivided to 14 thousand, 140 thousand, 1.4 million and 14 million triangles. Subdividing changes
no surface, so that only the number of triangles differs.

Seconds are medians over the runs; with them goes processor time, which other work on the machine
disturbs less. Memory is the most that was resident while placing. Linux only.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

COUNT = 1_400_000
COUNTS = (14_000, 140_000, 1_400_000, 14_000_000)
# The paper's scene of 1,404,052 polygons took 354 s for the primary camera and 580 s for the
# secondary ones (section IV).
PAPER_S = 934.0


def main() -> int:
    """Print the tables."""
    args = _arguments()
    with tempfile.TemporaryDirectory(prefix="relume-bench-", dir=args.scratch) as folder:
        at = Path(folder)
        for scene in args.scenes or [_demo(at)]:
            _large_scene(scene, args, at)
        if args.counts:
            _scaling(args, at)
    return 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.placement",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scenes", nargs="*", type=Path, metavar="SCENE.blend")
    parser.add_argument("--triangles", type=int, default=COUNT, metavar="N")
    parser.add_argument("--scaling", type=Path, metavar="SCENE.blend",
                        help="with at most as many triangles as the least of --counts")  # fmt: skip
    parser.add_argument("--counts", type=int, nargs="*", default=COUNTS, metavar="N",
                        help="triangles for the scaling table; none leaves it out")  # fmt: skip
    parser.add_argument("--cores", type=int, default=2, metavar="N")
    parser.add_argument("--runs", type=int, default=3, metavar="N")
    parser.add_argument("--scratch", type=Path, metavar="FOLDER", help="for the arrays: 1 GB")
    return parser.parse_args()


def _step(*arguments: object) -> dict[str, Any]:
    """One step in a process of its own; its report."""
    command = [sys.executable, "-m", "benchmarks.placement_run", *map(str, arguments)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def _demo(at: Path) -> Path:
    scene = at / "demo.blend"
    subprocess.run(
        [sys.executable, "-m", "tools.demo_scene", str(scene)],
        stdout=subprocess.DEVNULL, check=True,
    )  # fmt: skip
    return scene


def _large_scene(scene: Path, args: argparse.Namespace, at: Path) -> None:
    """The table of one scene."""
    arrays, fine = at / "scene", at / "fine"
    read = _step("extract", scene, arrays)
    _step("subdivide", arrays, args.triangles, fine)
    runs = [_step("place", fine, args.cores) for _ in range(args.runs - 1)]
    runs.append(_step("place", fine, args.cores, "fresh"))
    alone = None
    if read["active"] and read["views"] > 1:
        alone = _step("place", fine, args.cores, "fresh", f"view={read['active']}")
    fine.unlink()
    seconds = median(run["seconds"] for run in runs)
    print(
        f"{scene.stem}: {read['triangles']:,} triangles subdivided to {runs[0]['triangles']:,}, "
        f"{read['views']} views, {args.cores} cores, {args.runs} runs"
    )
    print(
        f"  read by Blender (apart)   {read['read_s']:7.2f} s  and {read['open_s']:.2f} s to open "
        f"the file; {read['peak_mb']:,.0f} MiB at most, Blender alone {read['blender_mb']:,.0f}"
    )
    for step in runs[0]["steps"]:
        print(f"  {step:<40.40}{median(run['steps'][step] for run in runs):8.2f} s")
    print(
        f"  {'all of the placement':<40}{seconds:8.2f} s, of a processor "
        f"{median(run['cpu_s'] for run in runs):.2f} s; the paper: {PAPER_S:.0f} s"
    )
    print(
        f"  memory: {median(run['peak_mb'] for run in runs):,.0f} MiB at most; "
        f"{runs[0]['before_mb']:,.0f} MiB before, with Python and the scene's arrays"
    )
    print(f"  {runs[0]['pictures']} pictures; {_shares(runs[-1])}")
    if alone is not None:
        print(
            f"  with the active camera, {read['active']}, as the shot: {alone['pictures']} "
            f"pictures; {_shares(alone)}"
        )
    print(flush=True)


def _shares(run: dict[str, Any]) -> str:
    fresh = run["fresh"]
    return (
        "on fresh samples, of what the views and moved views see: seen "
        f"{_percent(fresh['view_seen'])}, well {_percent(fresh['view_well'])}; of all that a free "
        f"point sees: seen {_percent(fresh['area_seen'])}, well {_percent(fresh['area_well'])}"
    )


def _percent(share: float) -> str:
    return "-" if math.isnan(share) else f"{100.0 * share:.1f} %"


def _scaling(args: argparse.Namespace, at: Path) -> None:
    """The table of one scene with more and more triangles."""
    arrays, fine = at / "scene", at / "fine"
    if args.scaling is None:
        own = _step("hall", arrays)["triangles"]
        print(f"a hall of boxes ({own:,} triangles) subdivided, {args.cores} cores")
    else:
        own = _step("extract", args.scaling, arrays)["triangles"]
        print(f"{args.scaling.stem} ({own:,} triangles) subdivided, {args.cores} cores")
    print(
        f"  {'triangles':>12}{'seconds':>10}{'times':>8}{'triangles':>11}{'processor':>11}"
        f"{'preparing':>11}{'peak MiB':>10}{'before':>8}{'by views':>10}"
    )
    last: tuple[int, float] | None = None
    for count in sorted(args.counts):
        _step("subdivide", arrays, count, fine)
        runs = [_step("place", fine, args.cores) for _ in range(args.runs)]
        fine.unlink()
        found, seconds = runs[0]["triangles"], median(run["seconds"] for run in runs)
        grown = f"{'':>8}{'':>11}"
        if last is not None:
            grown = f"{seconds / last[1]:>7.2f}x{found / last[0]:>10.1f}x"
        preparing = median(next(iter(run["steps"].values())) for run in runs)
        print(
            f"  {found:>12,}{seconds:>10.2f}{grown}{median(r['cpu_s'] for r in runs):>11.2f}"
            f"{preparing:>11.2f}{median(r['peak_mb'] for r in runs):>10,.0f}"
            f"{runs[0]['before_mb']:>8,.0f}{_percent(runs[0]['own']['seen']['by_view']):>10}",
            flush=True,
        )
        last = found, seconds


if __name__ == "__main__":
    sys.exit(main())
