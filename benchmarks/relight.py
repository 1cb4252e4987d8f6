# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast a light edit is, beside Cycles and EEVEE on the same machine in the same run.

    python -m benchmarks.relight [--triangles 1400000] [--lights 4] [--parts edit lights triangles]

A scene of heads is made and baked. Its key light is then edited in a running session of Relume, at
640x480 with shadow, and the median time to the picture is printed:

* beside Cycles: direct light only, persistent data, as many samples as give the same PSNR against
  one reference (interpolated between measured sample counts; one sample at least);
* beside EEVEE: one sample, and its steady time for a sample;
* by the number of lights and of triangles.

Every step is a process of its own, one after the other.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from .relight_figures import Bound, cycles_seconds, describe_costs, figures, per_sample

PARTS = ("edit", "lights", "triangles")


def main() -> int:
    """Print the tables; the exit status is 1 where a bound is missed."""
    args = _arguments()
    report: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="relume-bench-", dir=args.scratch) as folder:
        at = Path(folder)
        _placed(at)
        if "edit" in args.parts:
            report["edit"] = _edit(args, at)
        if "lights" in args.parts:
            report["lights"] = [
                _costs(args, at, args.sweep_triangles, count) for count in args.light_counts
            ]
        if "triangles" in args.parts:
            report["triangles"] = [
                _costs(args, at, count, args.lights) for count in args.triangle_counts
            ]
    args.out.parent.mkdir(parents=True, exist_ok=True)
    args.out.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    short: list[Bound] = []
    if "edit" in report:
        bounds = figures(report["edit"])
        short = [bound for bound in bounds if not bound.met]
        print("\n".join(str(bound) for bound in bounds))
    for part in ("lights", "triangles"):
        if part in report:
            print("\n" + describe_costs(report[part]))
    print(f"wrote {args.out}")
    return int(bool(short))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.relight",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--triangles", type=int, default=1_400_000)
    parser.add_argument("--lights", type=int, default=4)
    parser.add_argument("--size", default="640x480", metavar="WxH")
    parser.add_argument("--runs", type=int, default=15, metavar="N", help="edits to time")
    parser.add_argument("--shadows", nargs="+", choices=("map", "traced"),
                        default=("traced", "map"))  # fmt: skip
    parser.add_argument("--cycles-samples", default="1,2,4,8,16,32,64", metavar="N,...")
    parser.add_argument("--reference-samples", type=int, default=256, metavar="N")
    parser.add_argument("--light-counts", type=int, nargs="+", default=(1, 4, 15, 60))
    parser.add_argument("--sweep-triangles", type=int, default=100_000, metavar="N",
                        help="of the scene in which lights are counted")  # fmt: skip
    parser.add_argument("--triangle-counts", type=int, nargs="+",
                        default=(10_000, 100_000, 1_000_000, 10_000_000))  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("out/relight.json"), metavar="FILE.json")
    parser.add_argument("--scratch", type=Path, metavar="FOLDER", help="for scenes and caches")
    return parser.parse_args()


def run_step(module: str, *words: object) -> dict[str, Any]:
    """One step in a process of its own; its report."""
    print(f"{module} {words[0]} …", file=sys.stderr, flush=True)
    command = [sys.executable, "-m", f"benchmarks.{module}", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.stderr.write(done.stderr[-4000:])
        done.check_returncode()
    return json.loads(done.stdout.splitlines()[-1])


def _placed(at: Path) -> None:
    """Caching cameras for all the scenes: the heads stand in the same places."""
    small = at / "placed.blend"
    run_step("relight_run", "scene", 14_000, 4, small)
    run_step("caching_run", "place", small, "draft", at / "cameras.json")


def _baked(at: Path, triangles: int, lights: int) -> tuple[Path, Path]:
    """A scene and its cache."""
    scene, cache = at / f"{triangles}-{lights}.blend", at / f"{triangles}-{lights}.relume"
    if not scene.exists():
        run_step("relight_run", "scene", triangles, lights, scene)
        run_step("caching_run", "bake", scene, "draft", at / "cameras.json", cache)
    return scene, cache


def _edit(args: argparse.Namespace, at: Path) -> dict[str, Any]:
    scene, cache = _baked(at, args.triangles, args.lights)
    pictures = at / "pictures"
    pictures.mkdir()
    relume = {
        kind: run_step("relight_run", "edits", scene, cache, args.size, args.runs, kind, pictures)
        for kind in args.shadows
    }
    cycles = run_step("relight_run", "cycles", scene, args.size, args.cycles_samples, pictures)
    eevee = run_step("relight_run", "eevee", scene, args.size, "1,16")
    run_step("relight_run", "truth", scene, args.size, args.reference_samples, pictures)
    errors = run_step("relight_run", "errors", pictures)
    return {
        "relume": relume,
        "cycles": cycles["seconds"],
        "eevee": {"first_s": eevee["seconds"]["1"], "sample_s": per_sample(eevee["seconds"])},
        "errors": errors,
        "cycles_same_s": {
            kind: cycles_seconds(cycles["seconds"], errors, f"relume-{kind}-1") for kind in relume
        },
    }


def _costs(args: argparse.Namespace, at: Path, triangles: int, lights: int) -> dict[str, Any]:
    scene, cache = _baked(at, triangles, lights)
    runs = max(args.runs // 2, 5)
    return {
        kind: run_step("relight_run", "edits", scene, cache, args.size, runs, kind, at)
        for kind in args.shadows
    }


if __name__ == "__main__":
    sys.exit(main())
