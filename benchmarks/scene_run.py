# SPDX-License-Identifier: GPL-3.0-or-later
"""One step of `benchmarks.scene_accuracy` for one scene, in a process of its own.

    python -m benchmarks.scene_run STEP SCENE.blend --folder F [--preset P] [--size WxH] ...

The steps, each of which keeps what an earlier run of it left:

* plan: choose the views and place the caching cameras for each preset.
* bake: bake the cameras of a preset.
* relight: relight the views from that, with each number of samples.
* measure: render the views with Cycles, and hold what was relit against them.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import shutil
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from addon.argument_types import positive
from addon.caching.presets import PRESETS, Preset
from addon.errors import InputError
from addon.progress import Cancelled, Progress, part_of
from addon.scene.view import View
from addon.stopping import stop_signals, stoppable
from tools.output import progress_on, to_json
from tools.scene_file import load_blender, open_scene
from tools.verbs.arguments import size

from .kept_reference import KeptReference
from .scene_steps import picture_folder

STEPS = ("plan", "bake", "relight", "measure")
VIEWS = 4
# Of the reference's noise below what is measured; but less than this is enough for whoever asks
# whether 40 dB are reached, and 45 dB away from edges. Noise makes figures worse, never better.
MARGIN_DB = 6.0
FINER_BLOCKS = 6
QUIET_DB = {"whole": 49.0, "away_from_edges": 54.0}
# What is asked of the preset "final".
LEAST_DB = {"whole": 40.0, "away_from_edges": 45.0}
# Presets with which close views are to be sharp.
SHARPENED = ("final",)
# Another rule for views, or another way to place, makes another plan.
PLAN_VERSION = 2


class SceneRun:
    """The open scene and the folder of its results."""

    def __init__(self, args: argparse.Namespace, progress: Progress) -> None:
        load_blender()
        from tools.relit import read_scene, require_light, unmixed

        self._args, self._progress, self._folder = args, progress, Path(args.folder)
        progress(0.0, "opening the scene")
        self._scene = open_scene(args.scene)
        if args.size is not None:
            self._scene.render.resolution_x, self._scene.render.resolution_y = args.size
            self._scene.render.resolution_percentage = 100
        self._arrays = unmixed(read_scene(self._scene))
        require_light(self._scene, self._arrays)
        self._digest = hashlib.sha256(args.scene.read_bytes()).hexdigest()

    def run(self, step: str) -> None:
        {"plan": self.plan, "bake": self.bake, "relight": self.relight, "measure": self.measure}[
            step
        ]()

    # Steps ------------------------------------------------------------------------------------

    def plan(self) -> None:
        """Write plan.json and each preset's cameras.json."""
        from addon.camplace.cameras_file import write_cameras
        from addon.camplace.place import place_cameras
        from addon.camplace.settings import PlacementSettings
        from addon.scene.shot_reader import read_shot
        from tools.reference import light_groups
        from tools.relit import camera_names, read_views

        from .other_views import other_views

        path = self._folder / "plan.json"
        key = f"{self._digest} {PLAN_VERSION}"
        plan = _read(path) or {}
        if plan.get("key") != key:
            # What was made for another file, or other views, is of no use.
            shutil.rmtree(self._folder, ignore_errors=True)
            views = read_views(self._scene, camera_names(self._scene))
            others = other_views(views, self._arrays.geometry, VIEWS)
            plan = {
                "key": key,
                "scene": self._args.scene.name,
                "triangles": len(self._arrays.geometry),
                "lights": len(self._arrays.lights),
                "renders": len(light_groups()) + 1,
                "pixels": others[0].width * others[0].height,
                "size": [others[0].width, others[0].height],
                "views": [
                    {
                        "name": view.name,
                        "camera": self._base(view, views),
                        "world_from_camera": view.world_from_camera.tolist(),
                    }
                    for view in others
                ],
                "presets": {},
            }
        shot = read_shot(self._scene)
        missing = [preset for preset in self._args.presets if preset not in plan["presets"]]
        for number, preset in enumerate(missing):
            started = time.monotonic()
            ends = [(number + i) / len(missing) for i in (0, 1)]
            most = PRESETS[preset].max_resolution
            placement = place_cameras(
                self._arrays.geometry, shot, PlacementSettings(max_resolution=most),
                part_of(self._progress, *ends),
            )  # fmt: skip
            folder = self._folder / preset
            folder.mkdir(parents=True, exist_ok=True)
            write_cameras(folder / "cameras.json", placement.cameras)
            plan["presets"][preset] = {
                "cameras": len(placement.cameras),
                "texels": sum(min(c.resolution, most) ** 2 for c in placement.cameras),
                "seconds": time.monotonic() - started,
                "warnings": list(placement.warnings),
            }
            _write(path, plan)

    def bake(self) -> None:
        """Bake a preset's cameras; bake.json says how long all of it took."""
        from addon.baking import Baking
        from addon.caching.bake import BakeSettings
        from addon.camplace.cameras_file import read_cameras

        folder = self._preset_folder
        started = time.monotonic()
        settings = BakeSettings(self._args.preset, resume=True, overwrite=True)
        baking = Baking(self._scene, self._arrays.geometry, folder / "cache", settings)
        report = baking.run(read_cameras(folder / "cameras.json"), self._progress)
        seconds = time.monotonic() - started
        earlier = _read(folder / "bake.json") or {}
        planned = _read(self._folder / "plan.json")["presets"][self._args.preset]["texels"]  # type: ignore[index]
        if report.kept and not report.baked and earlier:
            return
        # A bake that was stopped and gone on with: as if all of it had gone at this run's pace.
        seconds *= planned / report.texels if report.kept and report.texels else 1.0
        found = {
            "seconds": seconds, "cache_bytes": report.cache_bytes, "cameras": report.cameras,
            "approximations": list(report.approximations), "notes": list(report.notes),
        }  # fmt: skip
        _write(folder / "bake.json", found)

    def relight(self) -> None:
        """Relight the views that were not yet."""
        views = self._views()
        for order, samples in enumerate(self._args.samples):
            missing = {
                name: view
                for name, view in views.items()
                if self._args.again or not (self._at(name, samples) / "relit.json").is_file()
            }
            ends = [(order + i) / len(self._args.samples) for i in (0, 1)]
            if missing:
                self._relight(missing, samples, part_of(self._progress, *ends))

    def _relight(self, views: dict[str, View], samples: int, progress: Progress) -> None:
        from tools.evaluation import Shot, relight_view
        from tools.filling import Filling
        from tools.relit import open_session

        cache = self._preset_folder / "cache"
        started = time.monotonic()
        session = open_session(
            self._arrays, cache, samples, part_of(progress, 0.0, 0.2), shadows=self._args.shadows
        )
        loading = time.monotonic() - started
        for number, (name, view) in enumerate(views.items()):
            ends = [0.2 + 0.8 * (number + i) / len(views) for i in (0, 1)]
            folder = self._at(name, samples)
            # The figures of an earlier picture go first.
            (folder / "figures.json").unlink(missing_ok=True)
            shot = Shot(name, self._scene.frame_current, view, folder)
            session.set_view(view)
            coverage = session.coverage
            with Filling(
                self._scene, self._arrays, cache, session,
                fills=not self._args.no_filling, keeps=False,
                sharpens=self._args.preset in SHARPENED,
            ) as filling:  # fmt: skip
                relit = relight_view(session, shot, part_of(progress, *ends), filling)
            # What one view had baked for it is not for the next one.
            session.set_added([])
            relit.write_relit(self._scene)
            report = {
                **relit.report,
                "hole_fraction": coverage.hole_fraction,
                "open_fraction": coverage.open_fraction,
                "left_fraction": relit.report["open_fraction"],
                "filling": filling.report(),
                "loading": loading,
                "warnings": [*session.warnings, *filling.notes],
            }
            _write(folder / "relit.json", report)

    def measure(self) -> None:
        """Render what Cycles has not yet, and write figures.json for each view that was relit."""
        from tools import reference

        prepared = False
        views = self._views()
        for number, (name, view) in enumerate(views.items()):
            step = part_of(self._progress, number / len(views), (number + 1) / len(views))
            folders = [
                folder
                for preset in self._args.presets
                for samples in sorted(self._args.samples)
                if ((folder := self._at(name, samples, preset)) / "relit.exr").is_file()
                and not (folder / "figures.json").is_file()
            ]
            if not folders:
                continue
            if not prepared:
                reference.prepare(self._scene)
                prepared = True
            kept = KeptReference(self._folder / name, self._key(view), self._args.reference_samples)
            camera = self._scene.objects[name]
            kept.require(self._scene, camera, part_of(step, 0.0, 0.5))
            figures = [_figures(kept, folder) for folder in folders]
            while kept.doublings < self._args.doublings and any(map(_is_noisy, figures)):
                kept.double(self._scene, camera, part_of(step, 0.5, 1.0))
                figures = [_figures(kept, folder) for folder in folders]
            # What is finest says where the reference is not.
            blocks = kept.finer_blocks(_relit(folders[-1]).rgb, self._args.finer_blocks)
            if blocks and any(map(_is_short, figures)):
                kept.refine(self._scene, camera, blocks, part_of(step, 0.5, 1.0))
                figures = [_figures(kept, folder) for folder in folders]
            for folder, found in zip(folders, figures, strict=True):
                _write(folder / "figures.json", found)
            kept.write_png(self._scene)

    # Parts ------------------------------------------------------------------------------------

    @property
    def _preset_folder(self) -> Path:
        return self._folder / str(self._args.preset)

    def _at(self, view: str, samples: int, preset: str | None = None) -> Path:
        return picture_folder(self._folder, preset or str(self._args.preset), view, samples)

    def _base(self, view: View, views: tuple[View, ...]) -> str:
        """The camera that a view was made from: the one with its lens, and next to it."""
        same = [v for v in views if np.array_equal(v.clip_from_camera, view.clip_from_camera)]
        return min(same, key=lambda v: float(np.linalg.norm(v.origin - view.origin))).name

    def _views(self) -> dict[str, View]:
        """Put the views' cameras into the scene, and read them."""
        import bpy

        from tools.relit import read_views

        plan = _read(self._folder / "plan.json")
        if plan is None:
            raise InputError(f"{self._folder} has no plan; run the step plan first")
        for entry in plan["views"]:
            camera: Any = bpy.data.objects.new(
                entry["name"], self._scene.objects[entry["camera"]].data
            )
            self._scene.collection.objects.link(camera)
            if camera.name != entry["name"]:
                raise InputError(f"an object of the scene is named {entry['name']}; rename it")
            camera.matrix_world = np.array(entry["world_from_camera"]).T.tolist()
        bpy.context.view_layer.update()
        names = [entry["name"] for entry in plan["views"]]
        found = read_views(self._scene, names)
        return {name: replace(view, name=name) for name, view in zip(names, found, strict=True)}

    def _key(self, view: View) -> str:
        """Of everything that a reference depends on."""
        parts = [
            self._digest.encode(),
            view.world_from_camera.tobytes(),
            view.clip_from_camera.tobytes(),
            f"{view.width} {view.height}".encode(),
        ]
        return hashlib.sha256(b"".join(parts)).hexdigest()


def _figures(kept: KeptReference, folder: Path) -> dict[str, Any]:
    """Of a relit picture, whose difference is left beside it."""
    from tools.comparison import compare_pictures
    from tools.picture_file import read_picture

    relit = _relit(folder)
    result = compare_pictures(read_picture(kept.picture), relit)
    result.write(folder)
    noise = {"whole": kept.noise(), "away_from_edges": kept.noise(~result.edge)}
    return {
        "whole": result.report["whole"],
        "away_from_edges": result.report["away_from_edges"],
        "noise": noise,
        "without_noise": {
            "whole": kept.noiseless_psnr(relit.rgb),
            "away_from_edges": kept.noiseless_psnr(relit.rgb, ~result.edge),
        },
        "flip_noise": kept.flip_noise(),
        "reference_samples": kept.samples,
        "finer_blocks": len(kept.finer),
    }


def _relit(folder: Path) -> Any:
    from tools.picture_file import read_picture

    return read_picture(folder / "relit.exr")


def _is_short(figures: dict[str, Any]) -> bool:
    """Whether the reference's rare samples may be why a picture is not as near as it should be."""
    found = [(figures["without_noise"][area], least) for area, least in LEAST_DB.items()]
    return any(value is not None and value < least for value, least in found)


def _is_noisy(figures: dict[str, Any]) -> bool:
    """Whether the reference's noise is a part of what was measured."""
    for area, noise in figures["noise"].items():
        measured = figures[area]["psnr_luma"]
        if measured is None or noise is None:
            continue
        if noise < min(measured + MARGIN_DB, QUIET_DB[area]):
            return True
    return False


def _read(path: Path) -> dict[str, Any] | None:
    if not path.is_file():
        return None
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def _write(path: Path, found: dict[str, Any]) -> None:
    from addon.whole_file import replacing

    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_text(to_json(found) + "\n", encoding="utf-8")


def _arguments() -> argparse.Namespace:
    presets: tuple[Preset, ...] = tuple(PRESETS)
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scene_run")
    parser.add_argument("step", choices=STEPS)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--preset", choices=presets)
    parser.add_argument("--presets", choices=presets, nargs="+", default=list(presets))
    parser.add_argument("--size", type=size)
    parser.add_argument("--samples", type=positive, nargs="+", required=True)
    parser.add_argument("--shadows", choices=("auto", "map", "traced"), default="auto")
    parser.add_argument("--reference-samples", type=positive, required=True)
    parser.add_argument("--doublings", type=int, required=True)
    parser.add_argument("--finer-blocks", type=int, default=FINER_BLOCKS)
    parser.add_argument("--no-filling", action="store_true")
    parser.add_argument("--again", action="store_true")
    return parser.parse_args()


def main() -> int:
    """0; 1 when it was stopped; 2 for what cannot be used."""
    args = _arguments()
    try:
        with stop_signals():
            SceneRun(args, stoppable(progress_on(sys.stderr))).run(args.step)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except (Cancelled, KeyboardInterrupt):
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
