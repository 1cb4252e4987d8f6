# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/scenes_accuracy.md and the contact sheets, from what `benchmarks.scene_run` left."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from addon.caching.presets import PRESETS
from tools.contact_sheet import Cell, Row, write_sheet

from .kept_reference import BLOCK, FINER
from .scene_run import FINER_BLOCKS, LEAST_DB
from .scene_steps import picture_folder, read_json

# What every view is to reach with the preset "final".
LEAST_PSNR, LEAST_AWAY = LEAST_DB["whole"], LEAST_DB["away_from_edges"]
LARGEST_FLIP, MOST_OPEN = 0.03, 0.001

HEAD = """# Accuracy in whole scenes

Four views of each scene that its caching cameras were not placed for, beside Cycles with the same
lights and direct light only. `make scene-accuracy SCENES="A.blend B.blend"` makes this page, and a
contact sheet for each scene in `out/accuracy/scenes/`. [accuracy.md](accuracy.md) has every kind of
light on every lobe.

The views come from the scene's own cameras by one rule for all scenes
(`benchmarks/other_views.py`): three to five tenths of the viewing distance away, where placement
looks from at most one tenth. The caching cameras are placed and baked as *Place* and *Bake* do it,
with each preset; *samples* are those of a relit pixel. PSNR is the paper's, of luma in the
display-encoded 8-bit picture; *away* leaves out 2 pixels about surfaces' edges and creases. SSIM is
of luma, HDR-FLIP the mean of the picture. *Holes* are pixels of the surface that no caching camera
sees, *open* those that neighbours did not fill, *left* what is open after surfaces were baked for
the view (`relume relight --fill-holes`; with *final* also those of which a pixel has less than one
texel, `--sharpen`), with which the pictures are measured.

The reference has noise (*noise at*), which makes every figure worse. It takes twice the samples
while that noise could hide the bounds below, at most a few times. It is two renders of other
seeds, which also says what a picture is off without any noise: in the product of what it is off the
one and off the other, noise has a mean of zero (`Reference.noiseless_psnr`). That is the figure in
brackets. Where that is short, up to {blocks} blocks of {block}x{block} pixels that hold most of the
error are rendered again with {finer} times the samples: of a lamp's mirror image on thin trim, a
thousandth of a pixel, both renders may have seen nothing. Of HDR-FLIP no such figure is known; that
of the reference's noise alone stands beside it. In dark pictures it looks at noise as if through a
camera's longest exposure. **Bold**: short of what is asked of the preset *final*, which is
{psnr:.0f} dB, {away:.0f} dB away from edges, HDR-FLIP {flip} and {open:.1f} % left.
"""


@dataclass(frozen=True)
class Decibels:
    """PSNR of luma: as measured, and without the reference's noise."""

    measured: float
    noiseless: float

    @classmethod
    def read(cls, part: Mapping[str, Any], noiseless: float | None) -> Decibels:
        """Of an area's figures."""
        return cls(_decibels(part["psnr_luma"]), _decibels(noiseless))

    def marked(self, least: float) -> str:
        """As the page shows it; bold where the picture itself falls short."""
        text = f"{self.measured:.1f} ({self.noiseless:.1f})"
        return text if self.noiseless >= least else f"**{text}**"


@dataclass(frozen=True)
class ViewFigures:
    """Of one view with one preset.

    Attributes:
        name: the view's.
        psnr, away: decibels, and without the reference's noise; infinite where there is no error.
        ssim, flip: means of the picture.
        holes, open, left: shares of the pixels that see a surface: that no caching camera sees,
            that neighbours did not fill either, and that are left after a bake for the view.
        fill_seconds: of that bake.
        seconds: of relighting.
        noise, flip_noise: of the reference, decibels and HDR-FLIP.
    """

    name: str
    psnr: Decibels
    away: Decibels
    ssim: float
    flip: float
    holes: float
    open: float
    left: float
    fill_seconds: float
    seconds: float
    noise: float
    flip_noise: float

    @classmethod
    def read(cls, folder: Path) -> ViewFigures | None:
        """Of a view's folder; None where it was not measured yet, as it is measured now."""
        found, relit = read_json(folder / "figures.json"), read_json(folder / "relit.json")
        if found is None or relit is None:
            return None
        if "without_noise" not in found or "filling" not in relit:  # an earlier version's
            return None
        whole, away = found["whole"], found["away_from_edges"]
        noiseless = found["without_noise"]
        return cls(
            folder.parent.name, Decibels.read(whole, noiseless["whole"]),
            Decibels.read(away, noiseless["away_from_edges"]), whole["ssim"], whole["flip"],
            relit["hole_fraction"], relit["open_fraction"], relit["left_fraction"],
            relit["filling"]["seconds"], relit["seconds_relight"],
            _decibels(found["noise"]["whole"]), found["flip_noise"],
        )  # fmt: skip


@dataclass(frozen=True)
class SceneFigures:
    """Of one scene with one preset and one number of samples of a relit pixel."""

    scene: str
    preset: str
    samples: int
    plan: dict[str, Any]
    bake: dict[str, Any]
    views: Sequence[ViewFigures]

    @property
    def row(self) -> str:
        """Of the table of all scenes: the mean of the views, and the worst of them."""
        views, planned = self.views, self.plan["presets"][self.preset]
        areas = [[v.psnr for v in views], [v.away for v in views]]
        worst = [min(area, key=lambda found: found.noiseless) for area in areas]
        cells = [
            self.scene, self.preset, str(self.samples), str(planned["cameras"]),
            f"{planned['texels'] / 1e6:.1f}", f"{self.bake['cache_bytes'] / 1e6:.0f}",
            f"{self.bake['seconds']:.0f}",
            f"{_mean([v.psnr.measured for v in views]):.1f} / {worst[0].marked(LEAST_PSNR)}",
            f"{_mean([v.away.measured for v in views]):.1f} / {worst[1].marked(LEAST_AWAY)}",
            f"{_mean([v.ssim for v in views]):.4f}",
            _most(max(v.flip for v in views), LARGEST_FLIP, "{:.3f}"),
            f"{100.0 * max(v.holes for v in views):.2f} %",
            f"{100.0 * max(v.open for v in views):.2f} %",
            _most(100.0 * max(v.left for v in views), 100.0 * MOST_OPEN, "{:.2f} %"),
            f"{_mean([v.fill_seconds for v in views]):.0f}",
            f"{_mean([v.seconds for v in views]):.1f}",
        ]  # fmt: skip
        return "| " + " | ".join(cells) + " |"


def read_scenes(folders: Sequence[Path]) -> list[SceneFigures]:
    """What was measured, scene by scene; presets of which no view was are left out."""
    found = []
    for folder in folders:
        plan = read_json(folder / "plan.json")
        for preset in PRESETS if plan is not None else ():
            assert plan is not None
            bake = read_json(folder / preset / "bake.json")
            for samples in _sample_counts(folder / preset):
                at = [picture_folder(folder, preset, v["name"], samples) for v in plan["views"]]
                views = [figures for each in at if (figures := ViewFigures.read(each)) is not None]
                if bake is not None and views:
                    scene = folder.parent.name
                    found.append(SceneFigures(scene, preset, samples, plan, bake, views))
    return found


def _sample_counts(folder: Path) -> list[int]:
    """Of a preset's pictures, from the fewest."""
    return sorted({int(path.parent.name.split()[0]) for path in folder.glob("*/*/relit.json")})


def write_page(path: Path, folders: Sequence[Path]) -> None:
    """Write the page; not where nothing was measured."""
    scenes = read_scenes(folders)
    if not scenes:
        return
    lines = [
        HEAD.format(
            blocks=FINER_BLOCKS, block=BLOCK, finer=FINER, psnr=LEAST_PSNR,
            away=LEAST_AWAY, flip=LARGEST_FLIP, open=100.0 * MOST_OPEN,
        )
    ]  # fmt: skip
    lines += _summary(scenes)
    for preset in PRESETS:
        lines += _views([scene for scene in scenes if scene.preset == preset], preset)
    path.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


def _summary(scenes: Sequence[SceneFigures]) -> list[str]:
    sizes = sorted({"{}x{}".format(*scene.plan["size"]) for scene in scenes})
    heads = [
        "scene", "preset", "samples", "cameras", "M texels", "MB", "bake s",
        "PSNR dB, mean / least", "away dB, mean / least", "SSIM", "HDR-FLIP, most",
        "holes, most", "open, most", "left, most", "fill s", "relight s",
    ]  # fmt: skip
    about = (
        f"Pictures of {', '.join(sizes)}. MB are those of the cache on the disk, *relight s* the "
        "mean time of a finished picture of a new view, *fill s* of the bake for it."
    )
    return [
        "## By scene", "", about, "",
        "| " + " | ".join(heads) + " |", "| --- " * len(heads) + "|",
        *(scene.row for scene in scenes), "",
    ]  # fmt: skip


def _views(scenes: Sequence[SceneFigures], preset: str) -> list[str]:
    """All views with one preset."""
    if not scenes:
        return []
    heads = [
        "scene", "view", "samples", "PSNR", "away", "SSIM", "HDR-FLIP", "holes", "open", "left",
        "noise at", "its HDR-FLIP",
    ]  # fmt: skip
    rows = []
    for scene in scenes:
        for view in scene.views:
            cells = [
                scene.scene, view.name, str(scene.samples), view.psnr.marked(LEAST_PSNR),
                view.away.marked(LEAST_AWAY), f"{view.ssim:.4f}",
                _most(view.flip, LARGEST_FLIP, "{:.3f}"), f"{100.0 * view.holes:.2f} %",
                f"{100.0 * view.open:.2f} %",
                _most(100.0 * view.left, 100.0 * MOST_OPEN, "{:.2f} %"), f"{view.noise:.1f}",
                f"{view.flip_noise:.3f}",
            ]  # fmt: skip
            rows.append("| " + " | ".join(cells) + " |")
    return [
        f"## All views: {preset}", "",
        "| " + " | ".join(heads) + " |", "| --- " * len(heads) + "|", *rows, "",
    ]  # fmt: skip


def draw_sheets(folders: Sequence[Path]) -> None:
    """A sheet for each scene: a row for each view, Cycles and each preset with its error, of
    the view's picture with the most samples."""
    for folder in folders:
        plan = read_json(folder / "plan.json")
        assert plan is not None
        rows = []
        for entry in plan["views"]:
            reference = folder / entry["name"] / "reference.png"
            if not reference.is_file():
                continue
            cells = [Cell(reference, "Cycles, direct light")]
            for preset in PRESETS:
                finest = _finest(folder, preset, entry["name"])
                if finest is None:
                    continue
                place, figures = finest
                words = f"{figures.psnr.measured:.1f} dB, away {figures.away.measured:.1f} dB"
                cells += [
                    Cell(place / "relit.png", f"Relume, {preset}", words),
                    Cell(place / "difference.png", "Difference, 8 times",
                         f"{100.0 * figures.holes:.2f} % holes, {100.0 * figures.left:.2f} % left"),
                ]  # fmt: skip
            rows.append(Row(f"{entry['name']}, from {entry['camera']}", cells))
        if rows:
            title = folder.parent.name
            write_sheet(folder / "sheet.png", title, "Views that the placement did not know", rows)


def _finest(folder: Path, preset: str, view: str) -> tuple[Path, ViewFigures] | None:
    """Of a view's pictures that were measured the one with the most samples: where it is, and its
    figures."""
    for samples in reversed(_sample_counts(folder / preset)):
        place = picture_folder(folder, preset, view, samples)
        figures = ViewFigures.read(place)
        if figures is not None:
            return place, figures
    return None


def _decibels(value: float | None) -> float:
    """Files hold no infinite numbers."""
    return math.inf if value is None else float(value)


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values)


def _most(value: float, bound: float, form: str) -> str:
    text = form.format(value)
    return text if value <= bound else f"**{text}**"
