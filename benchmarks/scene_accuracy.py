# SPDX-License-Identifier: GPL-3.0-or-later
"""How near Relume is to Cycles in whole scenes, in views that the placement did not know.

    python -m benchmarks.scene_accuracy [SCENE.blend ...] [--presets P ...] [--size WxH] ...

Of each scene (the demo's room, where none is named) four views are made by a rule
(`benchmarks/other_views.py`). For each preset the scene is baked, the views are relit, and held
against Cycles with direct light; with few samples and with more, since that is what speed is
traded for. Plans, caches, relit pictures and references stay in
out/accuracy/scenes/, so that a run that was stopped goes on, and one with other presets or scenes
adds its part. At first it says how long all of it takes. From all that is there
docs/scenes_accuracy.md is written, and a contact sheet for each scene.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from addon.argument_types import positive
from addon.caching.presets import PRESETS
from addon.sampling import PICTURE_SAMPLES
from addon.stopping import stop_signals
from tools.verbs.arguments import size

from .chosen_scenes import chosen_scenes
from .scene_steps import (
    Rates,
    Step,
    describe_plans,
    forget_pictures,
    in_order,
    read_json,
    steps_left,
)
from .scene_table import draw_sheets, write_page

REFERENCE_SAMPLES, DOUBLINGS = 16, 3
# As many as Blender gives a final render with EEVEE where nobody says.
FINE_SAMPLES = 64


def main() -> int:
    """Do what is left, and write the page; 0, or 1 when a step failed."""
    args = _arguments()
    scenes = chosen_scenes(args.scenes, args.folder)
    folders = {name: args.folder / name / _size_name(args.size) for name in scenes}
    for folder in folders.values():
        _forget(folder, args)
    rates = Rates.read(args.folder / "rates.json")
    failed: dict[str, str] = {}
    try:
        _do(_left(folders, args), scenes, folders, args, rates=rates, failed=failed)
        plans = {name: read_json(folder / "plan.json") for name, folder in folders.items()}
        known = {name: plan for name, plan in plans.items() if plan is not None}
        steps = _left({name: folders[name] for name in known}, args)
        _say(describe_plans(known, args.presets))
        _say(_forecast(steps, rates))
        if not args.plan:
            _do(steps, scenes, folders, args, rates=rates, failed=failed)
    except KeyboardInterrupt:
        _say("stopped; the same command goes on where it was")
        return 1
    finally:
        _write(args)
    for title, reason in failed.items():
        _say(f"FAILED {title}: {reason}")
    _say(f"{args.out}; {args.folder}/*/*/sheet.png")
    return 1 if failed else 0


def _left(folders: Mapping[str, Path], args: argparse.Namespace) -> list[Step]:
    return in_order(
        {
            name: steps_left(
                name, folder, args.presets, samples=args.samples,
                reference_samples=args.reference_samples,
            )
            for name, folder in folders.items()
        },
        args.presets,
    )  # fmt: skip


def _do(
    steps: list[Step],
    scenes: Mapping[str, Path],
    folders: Mapping[str, Path],
    args: argparse.Namespace,
    *,
    rates: Rates,
    failed: dict[str, str],
) -> None:
    """Run steps one after the other; what hangs on one that failed is left out."""
    for number, step in enumerate(steps):
        if f"{step.scene} {step.preset}" in failed:
            continue
        left = sum(rates.seconds(each) for each in steps[number:])
        _say(f"step {number + 1} of {len(steps)}: {step.title}; {_words(left)} left")
        started = time.monotonic()
        reason = _run(step, scenes[step.scene], folders[step.scene], args)
        if reason:
            failed[f"{step.scene} {step.preset}"] = f"{step.kind}: {reason}"
            _say(f"FAILED: {reason}")
            continue
        rates.note(step, time.monotonic() - started)
        if step.kind == "measure":
            if args.drop_caches:
                shutil.rmtree(folders[step.scene] / step.preset / "cache", ignore_errors=True)
            _write(args)


def _run(step: Step, scene: Path, folder: Path, args: argparse.Namespace) -> str:
    """Do a step in a process of its own, because Blender has one file open in each.

    Returns why it failed, "" if it did not.
    """
    command = [
        sys.executable, "-m", "benchmarks.scene_run", step.kind, str(scene),
        "--folder", str(folder), "--samples", *map(str, args.samples), "--shadows", args.shadows,
        "--reference-samples", str(args.reference_samples), "--doublings", str(args.doublings),
        "--presets", *args.presets,
    ]  # fmt: skip
    if args.no_filling:
        command.append("--no-filling")
    if step.preset:
        command += ["--preset", step.preset]
    if args.size is not None:
        command += ["--size", "{}x{}".format(*args.size)]
    done = subprocess.run(command, check=False, stdout=subprocess.DEVNULL)
    if done.returncode == 0:
        return ""
    why = {2: ", see above", -9: ", so it was killed: for memory?"}.get(done.returncode, "")
    return f"it ended with {done.returncode}{why}"


def _write(args: argparse.Namespace) -> None:
    """The page and the sheets, from all that is there in any folder."""
    found = sorted(args.folder.glob("*/*/plan.json"))
    wanted = [path.parent for path in found if path.parent.name == _size_name(args.size)]
    write_page(args.out, wanted)
    draw_sheets(wanted)


def _forget(folder: Path, args: argparse.Namespace) -> None:
    """Remove what is to be made anew."""
    if args.fresh:
        shutil.rmtree(folder, ignore_errors=True)
    plan = read_json(folder / "plan.json")
    for preset in args.presets if plan is not None else ():
        if args.bake_again:
            shutil.rmtree(folder / preset, ignore_errors=True)
            plan["presets"].pop(preset, None)  # type: ignore[index]
        if args.again:
            forget_pictures(folder, preset, args.samples)
    if plan is not None and args.bake_again:
        import json

        (folder / "plan.json").write_text(json.dumps(plan, indent=2), encoding="utf-8")


def _size_name(size: tuple[int, int] | None) -> str:
    return "own" if size is None else "{}x{}".format(*size)


def _forecast(steps: list[Step], rates: Rates) -> str:
    """How long what is left takes, by kind."""
    kinds = dict.fromkeys(step.kind for step in steps)
    parts = [
        f"{kind} {_words(sum(rates.seconds(s) for s in steps if s.kind == kind))}" for kind in kinds
    ]
    total = _words(sum(rates.seconds(step) for step in steps))
    return f"{len(steps)} steps take {total}: {', '.join(parts)}" if steps else "nothing is left"


def _words(seconds: float) -> str:
    if seconds < 90.0:
        return f"about {seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"about {minutes} min" if minutes < 90 else f"about {minutes // 60} h {minutes % 60} min"


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.scene_accuracy",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    presets = list(PRESETS)
    parser.add_argument("scenes", nargs="*", type=Path, metavar="SCENE.blend")
    parser.add_argument("--presets", nargs="+", choices=presets, default=presets, metavar="P",
                        help=f"of {', '.join(presets)}")  # fmt: skip
    parser.add_argument("--size", type=size, metavar="WxH",
                        help="of the pictures, and of those that are placed for "
                        "(default: each scene's own)")  # fmt: skip
    parser.add_argument("--samples", type=positive, nargs="+", metavar="N",
                        default=[PICTURE_SAMPLES, FINE_SAMPLES],
                        help="of a relit pixel; a picture for each "
                        "(default: %(default)s)")  # fmt: skip
    parser.add_argument("--shadows", choices=("auto", "map", "traced"), default="auto")
    parser.add_argument("--reference-samples", type=positive, default=REFERENCE_SAMPLES,
                        metavar="N", help="of a reference's pixel and light, to begin with "
                        "(default: %(default)s)")  # fmt: skip
    parser.add_argument("--doublings", type=int, default=DOUBLINGS, metavar="N",
                        help="how often they are doubled at most while the noise is too high "
                        "(default: %(default)s)")  # fmt: skip
    parser.add_argument("--no-filling", action="store_true",
                        help="leave the holes that neighbours do not fill")  # fmt: skip
    parser.add_argument("--plan", action="store_true",
                        help="place the cameras, say how long the rest takes, stop")  # fmt: skip
    parser.add_argument("--again", action="store_true",
                        help="relight anew; bakes, references and pictures of other samples "
                        "stay")  # fmt: skip
    parser.add_argument("--bake-again", action="store_true",
                        help="place, bake and relight anew; references stay")  # fmt: skip
    parser.add_argument("--fresh", action="store_true", help="forget all of these scenes")
    parser.add_argument("--drop-caches", action="store_true",
                        help="remove each cache once its views are measured")  # fmt: skip
    parser.add_argument("--folder", type=Path, default=Path("out/accuracy/scenes"))
    parser.add_argument("--out", type=Path, default=Path("docs/scenes_accuracy.md"))
    return parser.parse_args()


if __name__ == "__main__":
    with stop_signals():
        sys.exit(main())
