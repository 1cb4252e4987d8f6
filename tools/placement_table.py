# SPDX-License-Identifier: GPL-3.0-or-later
"""How good placements are: ours beside others with as many cameras, on fresh samples.

`python -m tools.placement_table SCENE.blend ...` prints a Markdown table for each question that
`tools.placement_measure` asks, `--ablations` what single parts of the method are worth.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.camplace.aim import aimed_camera, look
from addon.camplace.camera import CachingCamera
from addon.camplace.choose import choose_cameras
from addon.camplace.coverage import joined, visible_from
from addon.camplace.frame import LocalFrame
from addon.camplace.place import place_cameras
from addon.camplace.places import VotedPlaces, clear_places, near_spheres
from addon.camplace.prepare import Stage, prepare
from addon.camplace.settings import PlacementSettings
from addon.camplace.spheres import Spheres, find_spheres
from addon.progress import silent
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View

from .placement_measure import FreshSamples, Shares, free_among, free_region

# What is random is drawn so often, and the mean is shown.
DRAWS = 3
# Random places tried for each one wanted, since those in solids fall away.
SPARE = 16
# Widths of cameras that are aimed at random: those of a cube's face.
RANDOM_FOV = 0.5 * np.pi
# A budget is to be used up here, so that all have the same number of cameras.
LEAST_GAIN = 1e-6
# The grid of places is refined up to so many cells along a side.
FINEST_GRID = 64

NOWHERE = Spheres(np.zeros((0, 3)), np.zeros(0))

Makers = dict[str, Callable[[int, int], list[CachingCamera]]]


class Rivals:
    """A scene prepared as the placement prepares it, and other ways to place cameras in it.

    All have the highest resolution, ours only the one that it needs.
    """

    def __init__(
        self, geometry: SceneGeometry, views: Sequence[View], settings: PlacementSettings
    ) -> None:
        rng = np.random.default_rng(settings.seed)
        self.settings = settings
        self.frame = LocalFrame.of(geometry, tuple(views), settings.bounds)
        stage = prepare(
            self.frame.geometry_from_world(geometry),
            tuple(self.frame.view_from_world(view) for view in views),
            None,
            settings,
            rng,
        )
        self.spheres = find_spheres(
            stage.surface, stage.box, *stage.seeds, searches=settings.sphere_searches, rng=rng
        )
        self.stage: Stage = stage.settled_by(self.spheres.centre)
        self.near = near_spheres(self.stage)
        self.region = free_region(stage.geometry, stage.views, stage.box)

    def random_aimed(self, count: int, seed: int) -> list[CachingCamera]:
        """Random places in free space, aimed one after the other by the placement's own rule."""
        return self._aimed(self._random(count, np.random.default_rng(seed)))

    def random(self, count: int, seed: int) -> list[CachingCamera]:
        """Random places in free space, aimed at random."""
        rng = np.random.default_rng(seed)
        cameras = []
        for place in self._random(count, rng):
            forward = rng.normal(size=3)
            up = np.eye(3)[int(np.argmin(np.abs(forward)))]
            cameras.append(self._camera(look(place, forward, up), RANDOM_FOV))
        return cameras

    def grid(self, count: int, seed: int) -> list[CachingCamera]:  # noqa: ARG002
        """The coarsest grid with enough places in free space, aimed by the placement's rule.

        Where it has more places than are wanted, they are taken evenly from the list of them.
        """
        low, high = self.region
        for cells in range(1, FINEST_GRID):
            side = float((high - low).max()) / cells
            axes = [
                a + (np.arange(n) + 0.5) * (b - a) / n
                for a, b, n in zip(
                    low, high, np.maximum(1, np.round((high - low) / side)).astype(int), strict=True
                )
            ]
            places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            places = self._free(places)
            if len(places) >= count:
                break
        return self._aimed(places[(np.arange(count) * len(places)) // count])

    def ours(
        self,
        count: int,
        seed: int,
        *,
        spheres: bool = True,
        votes: bool = True,
        near: bool = True,
        cube: bool = False,
    ) -> list[CachingCamera]:
        """The placement, with spheres' centres or votes replaced by random places.

        With `cube` it is one primary camera and nothing else, whatever the `count`.
        """
        rng = np.random.default_rng(seed)
        settings = replace(self.settings, cameras=count)
        if cube:
            settings = replace(self.settings, primaries=1, secondaries=0)
        centres = self.spheres
        if not spheres:
            places = self._random(settings.candidates, rng)
            centres = Spheres(places, np.zeros(len(places)))
        chosen = choose_cameras(
            self.stage,
            centres,
            self.near if near else NOWHERE,
            settings,
            VotedPlaces(self.stage, settings, rng)
            if votes
            else lambda _worth: self._random(settings.candidates, rng),
            progress=silent,
        )
        return [self.frame.camera_to_world(c.camera) for group in chosen.groups for c in group]

    def _random(self, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
        """(count, 3) random places in free space."""
        low, high = self.region
        places = self._free(rng.uniform(low, high, (count * SPARE, 3)))
        return places[:count]

    def _free(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, 3) those of `places` outside of solids and as clear of surfaces as ours are."""
        views = self.stage.views
        origins = sum(view.perspective for view in views)
        free = free_among(places, views, self.stage.rays)[origins:]
        cell = float((self.stage.box[1] - self.stage.box[0]).max()) / self.settings.grid_cells
        return clear_places(self.stage, free, cell)

    def _aimed(self, places: NDArray[np.float64]) -> list[CachingCamera]:
        samples = self.stage.samples
        worth = np.zeros(len(samples))
        cameras = []
        for place in places:
            wanted = np.flatnonzero(samples.weight * (1.0 - worth) > 0.0)
            visible = visible_from(place, samples, self.stage.lift, self.stage.rays, wanted)
            if not visible.size:  # nothing is left to be seen from here: any aim is as good
                cameras.append(self._camera(look(place, np.eye(3)[0], np.eye(3)[2]), RANDOM_FOV))
                continue
            camera, seen, _ = aimed_camera(
                place, samples, visible, worth, self.settings.max_resolution
            )
            worth = joined(worth, seen)
            cameras.append(self.frame.camera_to_world(camera))
        return cameras

    def _camera(self, local: NDArray[np.float64], fov: float) -> CachingCamera:
        camera = CachingCamera(
            id=0,
            world_from_camera=local,
            fov=fov,
            near=0.0,
            far=np.inf,
            resolution=self.settings.max_resolution,
            kind="PERSPECTIVE",
            source=0,
        )
        return self.frame.camera_to_world(camera)


def measure_scene(
    geometry: SceneGeometry,
    views: Sequence[View],
    budgets: Sequence[int],
    *,
    ablations: bool,
    settings: PlacementSettings | None = None,
) -> list[dict[str, Any]]:
    """One entry for each way and budget: name, budget, most cameras used, `Shares`."""
    settings = replace(settings or PlacementSettings(), least_gain=LEAST_GAIN)
    rivals = Rivals(geometry, views, settings)
    box = rivals.frame.to_world(rivals.stage.box)
    fresh = FreshSamples(geometry, views, box)
    if ablations:
        makers: Makers = {
            "whole method": rivals.ours,
            "random places for spheres": lambda n, s: rivals.ours(n, s, spheres=False),
            "random places for votes": lambda n, s: rivals.ours(n, s, votes=False),
            "random places for both": lambda n, s: rivals.ours(n, s, spheres=False, votes=False),
            "no places near the views": lambda n, s: rivals.ours(n, s, near=False),
            "one cube, where it is best": lambda n, s: rivals.ours(n, s, cube=True),
            "one cube, in a maximal sphere": lambda n, s: rivals.ours(n, s, near=False, cube=True),
            "one cube, best of random places": lambda n, s: rivals.ours(
                n, s, spheres=False, near=False, cube=True
            ),
        }
    else:
        whole_set = replace(settings, view_share=0.0)
        makers = {
            "Relume": lambda n, s: _placed(geometry, views, settings, n, s),
            "Relume, whole set": lambda n, s: _placed(geometry, views, whole_set, n, s),
            "random, aimed": rivals.random_aimed,
            "random": rivals.random,
            "grid, aimed": rivals.grid,
        }
    rows = []
    for name, make in makers.items():
        for budget in budgets:
            draws = DRAWS if name.startswith("random") or ablations else 1
            sets = [make(budget, seed) for seed in range(draws)]
            shares = [fresh.measure(cameras) for cameras in sets]
            rows.append(
                {
                    "way": name,
                    "budget": budget,
                    "cameras": max(len(cameras) for cameras in sets),
                    "shares": Shares(*np.mean([_values(s) for s in shares], axis=0).tolist()),
                }
            )
            print(f"{name}, {budget}: {rows[-1]['shares']}", file=sys.stderr, flush=True)
    return rows


def _placed(
    geometry: SceneGeometry,
    views: Sequence[View],
    settings: PlacementSettings,
    count: int,
    seed: int,
) -> list[CachingCamera]:
    settings = replace(settings, cameras=count, seed=seed)
    return list(place_cameras(geometry, views, settings).cameras)


def table(rows: Sequence[dict[str, Any]], scene: str, budgets: Sequence[int]) -> list[str]:
    """Markdown rows: for each budget seen / well seen by view, and by area, in per cent."""
    lines = []
    for way in dict.fromkeys(row["way"] for row in rows):
        by_budget = {row["budget"]: row["shares"] for row in rows if row["way"] == way}
        cells = []
        for pick in (_by_view, _by_area):
            cells += [_pair(*pick(by_budget[budget])) for budget in budgets]
        lines.append(f"| {scene} | {way} | " + " | ".join(cells) + " |")
    return lines


def heading(budgets: Sequence[int]) -> list[str]:
    """The table's first two lines."""
    columns = [f"view, {b}" for b in budgets] + [f"area, {b}" for b in budgets]
    return [
        "| scene | cameras placed by | " + " | ".join(columns) + " |",
        "| --- | --- |" + " --- |" * len(columns),
    ]


def _by_view(shares: Shares) -> tuple[float, float]:
    return shares.view_seen, shares.view_well


def _by_area(shares: Shares) -> tuple[float, float]:
    return shares.area_seen, shares.area_well


def _pair(seen: float, well: float) -> str:
    return f"{100.0 * seen:.1f} / {100.0 * well:.1f}"


def _values(shares: Shares) -> tuple[float, float, float, float]:
    return shares.view_seen, shares.view_well, shares.area_seen, shares.area_well


def main() -> int:
    """Print the tables; each scene in a process of its own, since Blender holds one file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="+", type=Path, metavar="SCENE.blend")
    parser.add_argument("--budgets", default="4,8,16,32", help="numbers of cameras")
    parser.add_argument("--ablations", action="store_true", help="what parts of it are worth")
    args = parser.parse_args()
    budgets = tuple(int(part) for part in args.budgets.split(","))
    print("\n".join(heading(budgets)), flush=True)
    if len(args.scenes) > 1:
        own = [sys.executable, "-m", "tools.placement_table", "--budgets", args.budgets]
        own += ["--ablations"] if args.ablations else []
        for scene in args.scenes:
            done = subprocess.run([*own, str(scene)], check=True, stdout=subprocess.PIPE, text=True)
            # Blender says on standard output which file it reads.
            printed = [line for line in done.stdout.splitlines() if line.startswith("|")]
            print("\n".join(printed[len(heading(budgets)) :]), flush=True)
        return 0
    geometry, views = _read(args.scenes[0])
    rows = measure_scene(geometry, views, budgets, ablations=args.ablations)
    print("\n".join(table(rows, args.scenes[0].stem, budgets)), flush=True)
    return 0


def _read(path: Path) -> tuple[SceneGeometry, tuple[View, ...]]:
    from .scene_file import load_blender, open_scene

    load_blender()
    from addon.scene.shot_reader import read_shot

    from .relit import read_scene

    scene = open_scene(path)
    return read_scene(scene).geometry, tuple(read_shot(scene))


if __name__ == "__main__":
    sys.exit(main())
