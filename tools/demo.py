# SPDX-License-Identifier: GPL-3.0-or-later
"""`make demo`: the whole way, from a scene made by script to pictures measured against Cycles.

Builds a furnished room, places caching cameras, bakes them, relights four frames of a camera
move, moves and recolours two lights and relights again, renders the same with Cycles, and
leaves everything in one folder. Ends with 1 when a figure misses its target.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from addon.errors import InputError
from addon.progress import Progress, part_of
from addon.stopping import stop_signals, stoppable, uninterrupted

from .output import progress_on, standard_output, to_json

if TYPE_CHECKING:
    from addon.caching.presets import Preset
    from addon.camplace.placement import Placement
    from addon.scene.view import View

    from .evaluation import EvaluatedView
    from .relit import SceneArrays

PRESET: Preset = "balanced"
# Samples of a relit pixel, and of a reference's for each light: as many as show in the time that a
# demo may take what the targets below ask for. F12 has 16 of the first.
SAMPLES = 5
REFERENCE_SAMPLES = 80
# What every view must reach: luma, whole picture and away from edges; and its most holes.
LEAST_PSNR_DB = 30.0
LEAST_PSNR_AWAY_DB = 36.0
MOST_HOLES = 0.01


@dataclass
class Stages:
    """Seconds spent in each stage."""

    seconds: dict[str, float] = field(default_factory=dict)
    started: float = field(default_factory=time.monotonic)

    def end(self, name: str) -> None:
        """The stage of this name ends now; the next one begins."""
        now = time.monotonic()
        self.seconds[name] = round(now - self.started, 2)
        self.started = now


def run(out: Path, progress: Progress) -> dict[str, Any]:
    """Make the demo in a folder; gives the report.

    Raises:
        InputError: the folder cannot be written.
    """
    from .scene_file import load_blender, open_scene

    load_blender()
    from addon.baking import Baking
    from addon.caching.bake import BakeSettings

    from . import demo_scene, reference
    from .relit import read_scene, read_views

    stages = Stages()
    progress(0.0, "building the scene")
    with uninterrupted():
        demo_scene.build(out / "room.blend")
    scene = open_scene(out / "room.blend")
    arrays = read_scene(scene)
    shots = []
    for frame in demo_scene.SHOT_FRAMES:
        scene.frame_set(frame)
        shots.append((frame, read_views(scene, [None])[0]))
    stages.end("build the scene")
    placement = _place(scene, arrays, out, part_of(progress, 0.02, 0.12))
    stages.end("place the caching cameras")
    settings = BakeSettings(preset=PRESET, overwrite=True)
    baking = Baking(scene, arrays.geometry, out / "cache", settings)
    baked = baking.run(placement.cameras, part_of(progress, 0.12, 0.25))
    stages.end("bake")
    before, after = _relight(scene, arrays, out, shots, part_of(progress, 0.25, 0.50))
    stages.end("relight")
    reference.prepare(scene)
    _measure(scene, before, after, part_of(progress, 0.50, 0.98))
    stages.end("render and measure the references")
    report: dict[str, Any] = {
        "scene": {"file": str(out / "room.blend"), "triangles": len(arrays.geometry)},
        "bake": baked.to_json(),
        "edits": demo_scene.LIGHT_EDITS,
        "warnings": [*arrays.warnings, *placement.warnings, *baked.approximations],
        "views": [view.report for view in (*before, *after)],
        "seconds": stages.seconds,
    }
    report["missed"] = missed_targets(report["views"])
    _write_sheet(out, report, before, after)
    _write_highlights(out, before, after[0])
    (out / "report.json").write_text(to_json(report) + "\n", encoding="utf-8")
    progress(1.0, "done")
    return report


def _place(scene: Any, arrays: SceneArrays, out: Path, progress: Progress) -> Placement:
    """Place the cameras for the shot, and draw them."""
    from addon.caching.presets import PRESETS
    from addon.camplace.place import place_cameras
    from addon.camplace.settings import PlacementSettings
    from addon.scene.shot_reader import read_shot

    from .place_picture import draw_placement

    views = read_shot(scene)
    settings = PlacementSettings(max_resolution=PRESETS[PRESET].max_resolution)
    placement = place_cameras(arrays.geometry, views, settings, part_of(progress, 0.0, 0.9))
    progress(0.9, "drawing the cameras")
    draw_placement(arrays.geometry, placement, out / "cameras.png", views)
    return placement


def _relight(
    scene: Any,
    arrays: SceneArrays,
    out: Path,
    shots: Sequence[tuple[int, View]],
    progress: Progress,
) -> tuple[list[EvaluatedView], list[EvaluatedView]]:
    """All shots with the scene's lights, and the first one again with edited ones.

    An edit follows its shot at once, so that the session keeps the layers of the other lights.
    """
    from addon.relight.edits.edits_file import applied_edits

    from . import demo_scene
    from .evaluation import Shot, relight_view
    from .relit import open_session, read_lights_again

    progress(0.0, "loading the cache")
    with applied_edits(scene, demo_scene.LIGHT_EDITS):
        edited = read_lights_again(scene)
    session = open_session(arrays, out / "cache", SAMPLES)
    before: list[EvaluatedView] = []
    after: list[EvaluatedView] = []
    rounds = [("", arrays.lights, before), (" edited", edited, after)]
    for number, (frame, view) in enumerate(shots):
        step = part_of(progress, (number + 0.5) / 4.5, (number + 1.5) / 4.5)
        for suffix, lights, results in rounds[: 2 if number == 0 else 1]:
            name = f"frame {frame:03d}{suffix}"
            step(0.0, f"relighting {name}")
            session.set_lights(lights)
            shot = Shot(name, frame, view, out / name.replace(" ", "_"))
            results.append(relight_view(session, shot, step))
            results[-1].write_relit(scene)
    return before, after


def _measure(
    scene: Any,
    before: Sequence[EvaluatedView],
    after: Sequence[EvaluatedView],
    progress: Progress,
) -> None:
    """Render the references; those with edited lights start from those without."""
    from addon.relight.edits.edits_file import applied_edits

    from .demo_scene import LIGHT_EDITS
    from .evaluation import measure_all

    share = len(before) / (len(before) + 0.4 * len(after))
    measure_all(scene, before, REFERENCE_SAMPLES, part_of(progress, 0.0, share))
    with applied_edits(scene, LIGHT_EDITS):
        for number, view in enumerate(after):
            known = next(v.reference for v in before if v.shot.frame == view.shot.frame)
            ends = [share + (1.0 - share) * (number + i) / len(after) for i in (0, 1)]
            view.measure(
                scene,
                REFERENCE_SAMPLES,
                part_of(progress, *ends),
                known=known,
                changed=list(LIGHT_EDITS),
            )


def _write_sheet(
    out: Path,
    report: dict[str, Any],
    before: Sequence[EvaluatedView],
    after: Sequence[EvaluatedView],
) -> None:
    """The contact sheet: every view, and the cameras in the scene."""
    from .contact_sheet import Cell, Row, write_sheet

    cameras = report["bake"]["cameras"]
    triangles = report["scene"]["triangles"]
    rows = [view.row(f"Frame {view.shot.frame}") for view in before]
    rows += [
        view.row(f"Frame {view.shot.frame}, two lights moved and recoloured") for view in after
    ]
    cell = Cell(out / "cameras.png", "Caching cameras", f"{cameras} deep framebuffers", 3)
    rows.append(Row("Placement", [cell]))
    subtitle = f"A demo room of {triangles:,} triangles, baked once from {cameras} caching cameras"
    write_sheet(out / "contact_sheet.png", "Relume", subtitle, rows)


def _write_highlights(out: Path, before: Sequence[EvaluatedView], after: EvaluatedView) -> None:
    """One small JPEG for the README: relit, reference, correspondence map, and an edit."""
    from .contact_sheet import Row, draw_sheet

    first = before[0].row("").cells
    cells = [first[0], first[1], first[3], replace(after.row("").cells[0], label="Lights edited")]
    cells = [replace(cell, note="") for cell in cells]
    draw_sheet("", "", [Row("", cells)]).save(out / "highlights.jpg", quality=85)


def missed_targets(views: Sequence[dict[str, Any]]) -> list[str]:
    """One line for every figure that misses its target."""
    from .evaluation import NOISE_MARGIN_DB

    missed = []
    for view in views:
        for name, area, least in (
            ("PSNR (luma)", "whole", LEAST_PSNR_DB),
            ("PSNR away from edges", "away_from_edges", LEAST_PSNR_AWAY_DB),
        ):
            value = view[area]["psnr_luma"]
            if value is not None and (math.isnan(value) or value < least):
                missed.append(f"{view['view']}: {name} is {value:.2f} dB, less than {least:.0f}")
            # A picture as near to the reference as its noise is better than what is asked for.
            noise = view["reference"]["noise_floor"][area]["psnr_luma"]
            if noise is not None and not noise >= least + NOISE_MARGIN_DB:
                missed.append(
                    f"{view['view']}: the reference is too noisy, {noise:.2f} dB, to tell whether "
                    f"{name} is {least:.0f} dB"
                )
        if view["hole_fraction"] >= MOST_HOLES:
            missed.append(f"{view['view']}: {100 * view['hole_fraction']:.2f} % holes")
    return missed


def describe(out: Path, report: dict[str, Any]) -> str:
    """What to tell at the end: the figures and where to look."""
    from .evaluation import describe_views

    lines = [describe_views(report["views"]), ""]
    lines += [f"{name:36}{seconds:7.1f} s" for name, seconds in report["seconds"].items()]
    lines += ["", f"Look at {out / 'contact_sheet.png'}, the figures are in {out / 'report.json'}"]
    lines += [f"MISSED  {line}" for line in report["missed"]]
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Exit status 0, 1 when a target is missed or it is stopped, 2 for an unusable folder."""
    parser = argparse.ArgumentParser(prog="demo", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/demo"), metavar="DIR")
    args = parser.parse_args(argv)
    try:
        with stop_signals(), standard_output() as printed:
            report = run(args.out, stoppable(progress_on(sys.stderr)))
            printed.write(describe(args.out, report) + "\n")
    except (InputError, OSError) as error:
        print(f"demo: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("demo: stopped", file=sys.stderr)
        return 1
    return 1 if report["missed"] else 0


if __name__ == "__main__":
    sys.exit(main())
