# SPDX-License-Identifier: GPL-3.0-or-later
"""How small caches are, what compressing them costs the picture, and how long baking takes.

    python -m benchmarks.caching SCENE.blend ... [--preset balanced] [--skip error time]

For each scene, cameras are placed and baked. Then:

* Sizes: the channels that were asked for, vary, are unique and are stored (Ragan-Kelley et al.
  2007, figure 5); bytes on disk, unpacked, and in the textures that the GPU is given, beside all
  channels of the table as float32 for all texels.
* Error: a second bake of the same cameras keeps every channel as float32. Both are relit at one
  view and held against one reference of Cycles; only rounding and packing tell them apart.
* Time: the bake, with the reading of the scene but without the placement, beside one frame of
  Cycles, 1920x1080 at 256 samples, with the scene's own light paths (no adaptive sampling, no
  denoiser, no compositing). The frame is not rendered: its time is fixed + samples * slope, from
  renders with few samples.

Every step is a process of its own, and they run one after the other, on all cores.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from addon.caching.presets import DEFAULT_PRESET, PRESETS

from .caching_figures import (
    FRAME_SAMPLES,
    MOST_DB,
    MOST_SHARE_OF_FRAME,
    Bound,
    FrameTime,
    loss_db,
    shortfalls,
    size_bounds,
)

PARTS = ("gpu", "error", "time")


def main() -> int:
    """Print the tables; the exit status is 1 where a scene could not be measured."""
    args = _arguments()
    reports: list[dict[str, Any]] = []
    for scene in args.scenes:
        with tempfile.TemporaryDirectory(prefix="relume-bench-", dir=args.scratch) as folder:
            try:
                report = _measure(scene, args, Path(folder))
                print(describe(report) + "\n", flush=True)
            except subprocess.CalledProcessError as failed:
                report = {"scene": scene.stem, "failed": failed.cmd[3:]}
                print(f"{scene.stem}: failed at {failed.cmd[3]}\n", flush=True)
        reports.append(report)
        args.out.parent.mkdir(parents=True, exist_ok=True)
        args.out.write_text(json.dumps(reports, indent=2) + "\n", encoding="utf-8")
    print(f"wrote {args.out}")
    return int(any("failed" in report for report in reports))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.caching",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE.blend")
    parser.add_argument("--preset", choices=PRESETS, default=DEFAULT_PRESET)
    parser.add_argument("--placement", type=Path, metavar="CAMERAS.json",
                        help="take these cameras (default: they are placed)")  # fmt: skip
    parser.add_argument("--skip", nargs="*", choices=PARTS, default=(), metavar="PART",
                        help=f"parts to leave out: {', '.join(PARTS)}")  # fmt: skip
    parser.add_argument("--size", default="640x360", metavar="WxH", help="of the relit view")
    parser.add_argument("--samples", type=int, default=16, metavar="N", help="of the relit view")
    parser.add_argument("--reference-samples", type=int, default=64, metavar="N",
                        help="of the reference's pixels, for each light")  # fmt: skip
    parser.add_argument("--frame-samples", default="2,6", metavar="N,N",
                        help="with which the frame's time is measured")  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("out/caching.json"), metavar="FILE.json")
    parser.add_argument("--scratch", type=Path, metavar="FOLDER", help="for the caches")
    return parser.parse_args()


def _step(*arguments: object) -> dict[str, Any]:
    """One step in a process of its own; its report."""
    command = [sys.executable, "-m", "benchmarks.caching_run", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.stderr.write(done.stderr[-4000:])
        done.check_returncode()
    return json.loads(done.stdout.splitlines()[-1])


def _measure(scene: Path, args: argparse.Namespace, at: Path) -> dict[str, Any]:
    """All that is asked for of one scene."""
    cameras, cache = at / "cameras.json", at / "cache"
    known = [args.placement] if args.placement is not None else []
    placed = _step("place", scene, args.preset, cameras, *known)
    baked = _step("bake", scene, args.preset, cameras, cache)
    report = {"scene": scene.stem, "preset": args.preset, "placement": placed, "bake": baked}
    if "gpu" not in args.skip:
        report["gpu"] = _step("textures", scene, cache)
    if "error" not in args.skip:
        report["error"] = _error(scene, args, at, placed["camera"])
    if "time" not in args.skip:
        measured = _step("frame", scene, placed["camera"], args.frame_samples)
        line = FrameTime.through({int(n): s for n, s in measured["seconds"].items()})
        report["frame"] = {**measured, **vars(line), "whole_s": line.at(FRAME_SAMPLES)}
    bounds = _bounds(report)
    return report | {"bounds": [b.to_json() for b in bounds], "short": shortfalls(bounds)}


def _error(scene: Path, args: argparse.Namespace, at: Path, camera: str) -> dict[str, Any]:
    """What compression costs."""
    _step("bake", scene, args.preset, at / "cameras.json", at / "exact", "exact")
    samples = (args.samples, args.reference_samples)
    found = _step("error", scene, at / "cache", at / "exact", camera, args.size, *samples, at)
    loss = {
        key: loss_db(*(_infinite(found[name][key]) for name in ("exact", "shipped")))
        for key in ("psnr_rgb", "psnr_luma")
    }
    return {**found, "loss": loss}


def _infinite(psnr: float | None) -> float:
    """JSON has no infinite numbers: the PSNR of pictures without error is None there."""
    return float("inf") if psnr is None else psnr


def _bounds(report: dict[str, Any]) -> list[Bound]:
    baked = report["bake"]
    gpu = report["gpu"]["gpu_bytes"] if "gpu" in report else None
    everything = baked["texels"] * baked["bytes_per_texel"]["all_float32"]
    bounds = size_bounds(everything, baked["stored_bytes"], gpu, report["preset"])
    if "error" in report:
        worst = max(report["error"]["loss"].values())
        bounds.append(Bound("decibels lost to compression", worst, MOST_DB, at_least=False))
    if "frame" in report:
        share = baked["whole_s"] / report["frame"]["whole_s"]
        bounds.append(
            Bound("bake, in frames of Cycles", share, MOST_SHARE_OF_FRAME, at_least=False)
        )
    return bounds


def describe(report: dict[str, Any]) -> str:
    """The table of one scene."""
    baked, texels = report["bake"], report["bake"]["texels"]
    heading = (
        f"{report['scene']}: {report['preset']}, {baked['cameras']} cameras, "
        f"{texels / 1e6:.1f} million texels, {len(baked['materials'])} materials"
    )
    lines = [
        heading,
        *_channel_lines(baked["channels"]),
        *_size_lines(report),
    ]
    if "error" in report:
        lines += _error_lines(report["error"])
    seconds = ", ".join(f"{stage} {took:.1f}" for stage, took in baked["seconds"].items())
    lines.append(
        f"  baked in {baked['whole_s']:.1f} s, of processors {baked['cpu_s']:.1f} s: "
        f"read the scene {baked['read_scene_s']:.1f}, {seconds}; "
        f"placed apart in {report['placement']['seconds']:.1f} s"
    )
    if "frame" in report:
        lines += _frame_lines(report)
    return "\n".join([*lines, *(f"  SHORT  {sentence}" for sentence in report["short"])])


def _channel_lines(channels: dict[str, Any]) -> list[str]:
    stages = ("asked", "varying", "unique", "stored")
    constants = [entry["name"] for entry in channels["table"] if "constant" in entry["lives"]]
    return [
        f"  {'':<12}" + "".join(f"{stage:>9}" for stage in stages),
        *(
            f"  {what:<12}" + "".join(f"{channels[stage][what]:>9}" for stage in stages)
            for what in ("channels", "values")
        ),
        f"  constant: {', '.join(constants) or 'none'}",
    ]


def _size_lines(report: dict[str, Any]) -> list[str]:
    baked, texels = report["bake"], report["bake"]["texels"]
    everything = texels * baked["bytes_per_texel"]["all_float32"]
    sizes = {
        "all channels in float32": everything,
        "on disk": baked["stored_bytes"],
        "unpacked": baked["raw_bytes"],
    }
    if "gpu" in report:
        sizes["on the GPU"] = report["gpu"]["gpu_bytes"]
    lines = [f"  {'':<24}{'MB':>10}{'bytes a texel':>16}{'times smaller':>15}"]
    lines += [
        f"  {what:<24}{size / 1e6:>10.1f}{size / texels:>16.2f}{everything / max(size, 1):>15.1f}"
        for what, size in sizes.items()
    ]
    return lines


def _error_lines(error: dict[str, Any]) -> list[str]:
    def db(value: float | None) -> str:
        return "no error" if value is None else f"{value:.3f} dB"

    names = {"exact": "all float32", "shipped": "as stored", "apart": "one beside the other"}
    lines = [f"  {'against Cycles':<24}{'PSNR RGB':>14}{'PSNR luma':>14}{'FLIP':>9}"]
    lines += [
        f"  {title:<24}{db(error[key]['psnr_rgb']):>14}{db(error[key]['psnr_luma']):>14}"
        f"{error[key]['flip']:>9.4f}"
        for key, title in names.items()
    ]
    loss, floor = error["loss"], error["noise_floor"]
    lines.append(
        f"  lost to compression: {loss['psnr_rgb']:+.4f} dB RGB, {loss['psnr_luma']:+.4f} dB luma; "
        f"the reference's noise is at {db(floor['psnr_luma'])}"
    )
    return lines


def _frame_lines(report: dict[str, Any]) -> list[str]:
    frame = report["frame"]
    measured = ", ".join(f"{n} samples {took:.1f} s" for n, took in frame["seconds"].items())
    share = report["bake"]["whole_s"] / frame["whole_s"]
    line = (
        f"  one frame of Cycles, 1920x1080: {measured}; so {frame['fixed']:.1f} s and "
        f"{frame['sample']:.2f} s a sample, {frame['whole_s']:.0f} s at {FRAME_SAMPLES} samples"
    )
    return [line, f"  the bake takes {100.0 * share:.1f} % of that"]


if __name__ == "__main__":
    sys.exit(main())
