# SPDX-License-Identifier: GPL-3.0-or-later
"""A camera flight through scenes: holes, steps across seams and flicker of every frame.

    python -m benchmarks.flight [SCENE.blend ...] [--frames 240] [--size 240x180] [--preset P]

Each scene (the demo's room, where none is named) is baked as *Place* and *Bake* do it, and flown
through by one rule (`benchmarks/flight_path.py`): past its own cameras and past views beside them
that the placement did not know. Bakes and figures stay in out/flight/; a run that was stopped goes
on with the scene that it was at. The plot is out/flight/flight.png, and each scene has a sheet of
its worst frames.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from addon.argument_types import positive
from addon.caching.presets import DEFAULT_PRESET, PRESETS
from addon.stopping import stop_signals
from tools.verbs.arguments import size

from .chosen_scenes import chosen_scenes

Row = dict[str, Any]


def _of_flicker(name: str) -> Callable[[Row], float]:
    return lambda row: np.nan if row["flicker"] is None else float(row["flicker"][name])


# The plot's panels: an axis, and its lines with what each shows of a frame.
PANELS: tuple[tuple[str, Mapping[str, Callable[[Row], float]]], ...] = (
    ("holes, % of the surface", {
        "seen by no caching camera": lambda row: 100.0 * row["holes"],
        "open after filling": lambda row: 100.0 * row["open"],
    }),
    ("seams, % of neighbours", {
        "of two cameras": lambda row: 100.0 * row["seams"]["share"],
    }),
    ("step, levels of 255", {
        "across seams": lambda row: row["seams"]["step"],
        "beside them": lambda row: row["seams"]["beside"],
    }),
    ("change of a point, levels", {
        "whose camera stayed": _of_flicker("stayed_change"),
        "whose camera switched": _of_flicker("switched_change"),
    }),
    ("flicker, levels", {
        "all, by switching": _of_flicker("excess"),
    }),
)  # fmt: skip


def main() -> int:
    """Fly through what was not yet, and draw the plot; 0, or 1 when a scene failed."""
    args = _arguments()
    scenes = chosen_scenes(args.scenes, args.folder)
    failed = []
    for number, (name, scene) in enumerate(scenes.items(), start=1):
        folder = args.folder / name
        if not args.again and _is_done(folder, args):
            continue
        print(f"{name} ({number} of {len(scenes)})", file=sys.stderr, flush=True)
        command = [
            sys.executable, "-m", "benchmarks.flight_run", str(scene), "--folder", str(folder),
            "--frames", str(args.frames), "--size", "{}x{}".format(*args.size),
            "--preset", args.preset,
        ]  # fmt: skip
        done = subprocess.run(command, check=False, stdout=subprocess.DEVNULL)
        if done.returncode != 0:
            failed.append(name)
    flights = {
        name: json.loads((args.folder / name / "flight.json").read_text(encoding="utf-8"))
        for name in scenes
        if name not in failed
    }
    if flights:
        draw(flights, args.folder / "flight.png")
        print(table(flights))
        print(f"see {args.folder / 'flight.png'} and {args.folder}/*/sheet.png")
    for name in failed:
        print(f"{name} failed", file=sys.stderr)
    return 1 if failed else 0


def draw(flights: Mapping[str, dict[str, Any]], path: Path) -> None:
    """A column for each scene, a panel for each kind of figure."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(1.0 + 5.5 * len(flights), 2.1 * len(PANELS)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(PANELS), len(flights), sharex="col", sharey="row", squeeze=False)
    for column, (name, flight) in enumerate(flights.items()):
        frames = np.arange(1, len(flight["frames"]) + 1)
        for row, (label, lines) in enumerate(PANELS):
            panel = axes[row][column]
            for line, of in lines.items():
                panel.plot(frames, [of(r) for r in flight["frames"]], linewidth=1.0, label=line)
            panel.grid(alpha=0.3)
            if column == 0:
                panel.set_ylabel(label)
                panel.legend(fontsize="small", loc="upper left")
        axes[0][column].set_title(f"{name}, {flight['cameras']} caching cameras")
        axes[-1][column].set_xlabel("frame")
    for panel in axes[:, 0]:
        # The panels of a row share their axis, so this comes when all lines are there.
        panel.set_ylim(bottom=0.0)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)


def table(flights: Mapping[str, dict[str, Any]]) -> str:
    """Mean and worst frame of each figure, in Markdown."""
    heads = [
        "scene", "holes %", "open %", "seams %", "step across seams", "beside", "switched %",
        "change, stayed", "change, switched", "flicker",
    ]  # fmt: skip
    figures: Sequence[Callable[[Row], float]] = (
        *PANELS[0][1].values(), *PANELS[1][1].values(), *PANELS[2][1].values(),
        lambda row: 100.0 * _of_flicker("switched")(row),
        *PANELS[3][1].values(), *PANELS[4][1].values(),
    )  # fmt: skip
    lines = ["| " + " | ".join(heads) + " |", "| --- " * len(heads) + "|"]
    for name, flight in flights.items():
        cells = []
        for of in figures:
            values = [of(row) for row in flight["frames"]]
            cells.append(f"{np.nanmean(values):.2f} / {np.nanmax(values):.2f}")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _is_done(folder: Path, args: argparse.Namespace) -> bool:
    path = folder / "flight.json"
    if not path.is_file():
        return False
    found = json.loads(path.read_text(encoding="utf-8"))
    asked = (args.preset, list(args.size), args.frames)
    return (found["preset"], found["size"], len(found["frames"])) == asked


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.flight",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scenes", nargs="*", type=Path, metavar="SCENE.blend")
    parser.add_argument("--frames", type=positive, default=240, metavar="N",
                        help="default: %(default)s")  # fmt: skip
    parser.add_argument("--size", type=size, default=(240, 180), metavar="WxH",
                        help="default: 240x180")  # fmt: skip
    parser.add_argument("--preset", choices=tuple(PRESETS), default=DEFAULT_PRESET,
                        help="of the bake (default: %(default)s)")  # fmt: skip
    parser.add_argument("--again", action="store_true", help="fly also what was flown; bakes stay")
    parser.add_argument("--folder", type=Path, default=Path("out/flight"))
    return parser.parse_args()


if __name__ == "__main__":
    with stop_signals():
        sys.exit(main())
