# SPDX-License-Identifier: GPL-3.0-or-later
"""Relit views held against Cycles: pictures and figures, one folder for each view."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from addon.progress import Progress, part_of
from addon.scene.view import View

from .comparison import compare_pictures
from .confidence_table import confidence_colors, error_by_confidence
from .contact_sheet import Cell, Row
from .display import correspondence_colors, write_display_png
from .picture_file import read_picture, write_exr, write_png
from .reference import Reference, render_reference

if TYPE_CHECKING:
    from addon.relight.session import RelightSession

    from .filling import Filling

# The reference's noise must be this much lower than the error that it measures.
NOISE_MARGIN_DB = 6.0
# More than a reference's seeds: two for each group of lights and two without lights.
SEED_STRIDE = 100


@dataclass(frozen=True)
class Shot:
    """A view to evaluate: its name in the report, its frame, and the folder for its pictures."""

    name: str
    frame: int
    view: View
    folder: Path


@dataclass
class EvaluatedView:
    """One view on its way through the evaluation.

    Attributes:
        shot: which view.
        combined: (H, W, 4) float32, the relit picture, scene-linear, row 0 at the bottom.
        correspondence: (H, W, 4) float32.
        confidence: (H, W, 4) float32, see `Confidence.read`.
        report: its part of the report.
        reference: Cycles' picture, once it is rendered.
    """

    shot: Shot
    combined: NDArray[np.float32]
    correspondence: NDArray[np.float32]
    confidence: NDArray[np.float32]
    report: dict[str, Any] = field(default_factory=dict)
    reference: Reference | None = None

    def write_relit(self, scene: Any) -> None:
        """Write relit.exr, relit.png, correspondence.png and confidence.png."""
        write_exr(self.shot.folder / "relit.exr", self.combined)
        write_display_png(scene, self.combined, self.shot.folder / "relit.png")
        write_png(
            self.shot.folder / "correspondence.png", correspondence_colors(self.correspondence)
        )
        write_png(self.shot.folder / "confidence.png", confidence_colors(self.confidence))

    def measure(
        self,
        scene: Any,
        samples: int,
        progress: Progress,
        *,
        doublings: int = 0,
        known: Reference | None = None,
        changed: Sequence[str] = (),
    ) -> None:
        """Render the reference, write it, and put the figures into the report.

        Args:
            scene: prepared by `reference.prepare`, with the lights as the view was relit.
            samples: for each pixel and light.
            progress: told of the reference's renders.
            doublings: how often the samples may be doubled while the noise is too high.
            known: the reference of the same view under other lights, to start from.
            changed: the names of the lights that are different from `known`.
        """
        started = time.monotonic()
        scene.frame_set(self.shot.frame)
        camera = scene.objects[self.shot.view.name]
        self.reference = render_reference(
            scene, camera, samples, progress, known=known, changed=changed
        )
        self._compare(samples)
        while doublings > 0 and not self.report["reference"]["noise_is_low_enough"]:
            # Seeds of earlier renders are all below the number of samples times this.
            more = render_reference(
                scene, camera, samples, progress, first_seed=samples * SEED_STRIDE
            )
            self.reference = self.reference.joined(more)
            samples, doublings = 2 * samples, doublings - 1
            self._compare(samples)
        write_display_png(scene, self.reference.rgba, self.shot.folder / "reference.png")
        self.report["seconds_reference"] = round(time.monotonic() - started, 2)

    def _compare(self, samples: int) -> None:
        """Hold the relit picture against the reference as it is now."""
        assert self.reference is not None
        self.reference.write(self.shot.folder / "reference.exr")
        relit = read_picture(self.shot.folder / "relit.exr")
        reference = read_picture(self.shot.folder / "reference.exr")
        result = compare_pictures(reference, relit)
        result.write(self.shot.folder)
        self.report |= {
            "whole": result.report["whole"],
            "away_from_edges": result.report["away_from_edges"],
            "error_by_confidence": error_by_confidence(self.confidence, reference.rgb, relit.rgb),
            "reference": self._noise(samples, result.edge, result.report),
            "psnr_luma_without_noise": {
                "whole": self.reference.noiseless_psnr(relit.rgb),
                "away_from_edges": self.reference.noiseless_psnr(relit.rgb, ~result.edge),
            },
        }

    def _noise(
        self, samples: int, edge: NDArray[np.bool_], report: dict[str, Any]
    ) -> dict[str, Any]:
        """The reference's noise, and whether it is low enough for what was measured."""
        assert self.reference is not None
        floors = {
            "whole": self.reference.noise_floor(),
            "away_from_edges": self.reference.noise_floor(~edge),
        }
        enough = all(
            floor[key] is None
            or report[area][key] is None
            or floor[key] >= report[area][key] + NOISE_MARGIN_DB
            for area, floor in floors.items()
            for key in ("psnr_rgb", "psnr_luma")
        )
        return {
            "samples_per_light": samples,
            "noise_floor": floors,
            "noise_is_low_enough": enough,
        }

    def row(self, heading: str) -> Row:
        """The view's row of the contact sheet."""
        seconds = f"{self.report['seconds_relight']:.1f} s"
        cells = [Cell(self.shot.folder / "relit.png", "Relume", seconds)]
        if self.reference is not None:
            away, whole = self.report["away_from_edges"], self.report["whole"]
            floor = _db(self.report["reference"]["noise_floor"]["whole"]["psnr_luma"])
            error = f"{_db(whole['psnr_luma'])}, away from edges {_db(away['psnr_luma'])}"
            cells += [
                Cell(
                    self.shot.folder / "reference.png", "Cycles, direct light", f"noise at {floor}"
                ),
                Cell(self.shot.folder / "difference.png", "Difference, 8 times", error),
            ]
        holes = f"{100.0 * self.report['hole_fraction']:.2f} % holes"
        cells.append(Cell(self.shot.folder / "correspondence.png", "Correspondence map", holes))
        return Row(heading, cells)


def _db(value: float | None) -> str:
    if value is None:
        return "no pixels"
    return "no error" if np.isinf(value) else f"{value:.1f} dB"


def relight_view(
    session: RelightSession, shot: Shot, progress: Progress, filling: Filling | None = None
) -> EvaluatedView:
    """Relight one view with the present lights, and its holes filled by `filling`."""
    view = shot.view
    if filling is not None:
        filling.fill(view, progress)
    started = time.monotonic()
    session.set_view(view)
    picture = session.render(progress)
    report = {
        "view": shot.name,
        "camera": view.name,
        "frame": shot.frame,
        "width": view.width,
        "height": view.height,
        "samples": picture.samples,
        "hole_fraction": picture.coverage.hole_fraction,
        "open_fraction": picture.coverage.open_fraction,
        "seconds_relight": round(time.monotonic() - started, 3),
    }
    confidence = session.confidence().read()
    return EvaluatedView(shot, picture.combined, picture.correspondence, confidence, report)


def measure_all(
    scene: Any,
    views: Sequence[EvaluatedView],
    samples: int,
    progress: Progress,
    doublings: int = 0,
) -> None:
    """Measure every view under the scene's present lights."""
    for number, view in enumerate(views):
        ends = [(number + i) / len(views) for i in (0, 1)]
        view.measure(scene, samples, part_of(progress, *ends), doublings=doublings)


def describe_views(reports: Sequence[dict[str, Any]]) -> str:
    """A table of the figures for a person."""
    columns = f"{'RGB':>8}{'luma':>8}{'FLIP':>7}"
    lines = [
        f"{'':24}{'whole picture':^23}{'away from edges':^23}",
        f"{'view':24}{columns}{columns}{'holes':>9}{'noise':>8}",
    ]
    for report in reports:
        whole, away = report["whole"], report["away_from_edges"]
        floor = report["reference"]["noise_floor"]["whole"]["psnr_luma"]
        cells = "".join(
            f"{_number(part[key], 2):>8}" if key != "flip" else f"{_number(part[key], 3):>7}"
            for part in (whole, away)
            for key in ("psnr_rgb", "psnr_luma", "flip")
        )
        holes = f"{100.0 * report['hole_fraction']:.2f} %"
        mark = "" if report["reference"]["noise_is_low_enough"] else " !"
        lines.append(f"{report['view']:24}{cells}{holes:>9}{_number(floor, 1):>8}{mark}")
    if any(not report["reference"]["noise_is_low_enough"] for report in reports):
        lines.append(
            f"! the reference's noise is less than {NOISE_MARGIN_DB:.0f} dB below the error: "
            "measure with more --reference-samples"
        )
    return "\n".join(lines)


def _number(value: float | None, digits: int) -> str:
    """The number; "-" for none and for an infinite one, "nan" for one that was not computed."""
    return "-" if value is None or np.isinf(value) else f"{value:.{digits}f}"
