# SPDX-License-Identifier: GPL-3.0-or-later
"""What a run of the scenes' accuracy does next, how long it says that takes, and its page."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from benchmarks import scene_table
from benchmarks.scene_steps import (
    Rates,
    Step,
    forget_pictures,
    in_order,
    picture_folder,
    steps_left,
)
from benchmarks.scene_table import draw_sheets, read_scenes, write_page
from tools.contact_sheet import Row

VIEWS = ["Other 1", "Other 2"]


def _write(path: Path, found: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(found), encoding="utf-8")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A planned scene, of which nothing was baked."""
    folder = tmp_path / "hall" / "own"
    presets = {name: {"cameras": 3, "texels": 1000} for name in ("draft", "final")}
    views = [{"name": name, "camera": "Camera"} for name in VIEWS]
    plan = {
        "pixels": 100, "size": [10, 10], "renders": 3, "lights": 2, "triangles": 12,
        "views": views, "presets": presets,
    }  # fmt: skip
    _write(folder / "plan.json", plan)
    return folder


def _relit(
    folder: Path, preset: str, psnr: float | None, noiseless: float | None, samples: int = 4
) -> None:
    _write(folder / preset / "bake.json", {"seconds": 5.0, "cache_bytes": 4_000_000})
    for view in VIEWS:
        place = picture_folder(folder, preset, view, samples)
        _write(place / "relit.json", {
            "hole_fraction": 0.02, "open_fraction": 0.004, "left_fraction": 0.002,
            "filling": {"seconds": 3.0}, "seconds_relight": 1.5,
        })  # fmt: skip
        part = {"psnr_luma": psnr, "ssim": 0.99, "flip": 0.02}
        _write(place / "figures.json", {
            "whole": part, "away_from_edges": part,
            "noise": {"whole": 48.0, "away_from_edges": 50.0}, "flip_noise": 0.004,
            "without_noise": {"whole": noiseless, "away_from_edges": noiseless},
        })  # fmt: skip


def _left(folder: Path, presets: list[str], samples: Sequence[int] = (4,)) -> list[Step]:
    return steps_left("hall", folder, presets, samples=samples, reference_samples=8)


def test_a_scene_is_planned_first(tmp_path: Path, folder: Path) -> None:
    assert [s.kind for s in _left(tmp_path / "nowhere", ["draft"])] == ["plan"]
    # A preset that was not planned yet, too.
    assert [s.kind for s in _left(folder, ["draft", "balanced"])] == ["plan"]


def test_then_baked_relit_and_measured_preset_by_preset(folder: Path) -> None:
    presets = ["draft", "final"]
    kinds = [(s.kind, s.preset) for s in _left(folder, presets)]
    assert kinds == [(kind, p) for p in presets for kind in ("bake", "relight", "measure")]
    two = {"hall": _left(folder, presets), "yard": _left(folder, presets)}
    assert [s.preset for s in in_order(two, presets)] == ["draft"] * 6 + ["final"] * 6


def test_what_is_done_is_left_out(folder: Path) -> None:
    _relit(folder, "draft", 38.0, 50.0)
    assert {s.preset for s in _left(folder, ["draft", "final"])} == {"final"}
    (folder / "draft" / "Other 2" / "4 samples" / "figures.json").unlink()
    assert [s.kind for s in _left(folder, ["draft"])] == ["measure"]
    (folder / "draft" / "Other 2" / "4 samples" / "relit.json").unlink()
    # The bake is kept, if it is still good.
    again = _left(folder, ["draft"])
    assert [s.kind for s in again] == ["bake", "relight", "measure"]
    assert again[0].work == 0.0


def test_references_are_rendered_once(folder: Path) -> None:
    measure = [s for s in _left(folder, ["draft", "final"]) if s.kind == "measure"]
    assert measure[0].work > 0.0
    assert measure[1].work == 0.0
    (folder / "Other 1").mkdir()
    (folder / "Other 1" / "reference.npz").touch()
    again = next(s for s in _left(folder, ["draft"]) if s.kind == "measure")
    assert again.work == measure[0].work / 2


def test_a_step_takes_as_long_as_one_like_it_did(tmp_path: Path) -> None:
    rates = Rates.read(tmp_path / "rates.json")
    step, twice = Step("bake", "hall", "draft", 1e7), Step("bake", "hall", "final", 2e7)
    rates.note(step, step.least + 100.0)
    assert rates.seconds(twice) == pytest.approx(twice.least + 200.0)
    # Others go at its pace until they were measured themselves; and it is known to the next run.
    later = Rates.read(tmp_path / "rates.json")
    assert later.seconds(Step("bake", "yard", "draft", 1e7)) == pytest.approx(step.least + 100.0)


def test_the_page_marks_what_is_short_without_the_references_noise(
    folder: Path, tmp_path: Path
) -> None:
    _relit(folder, "draft", 38.0, 38.5)
    _relit(folder, "final", 39.0, 45.5)
    page = tmp_path / "page.md"
    write_page(page, [folder])
    text = page.read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| hall | Other 1 | 4 |")]
    assert "| **38.0 (38.5)** | **38.0 (38.5)** |" in rows[0]
    assert "| 39.0 (45.5) | 39.0 (45.5) |" in rows[1]
    assert "| 2.00 % | 0.40 % | **0.20 %** |" in rows[0]
    assert "| hall | draft | 4 | 3 |" in text


def test_each_number_of_samples_has_pictures_and_rows_of_its_own(
    folder: Path, tmp_path: Path
) -> None:
    _relit(folder, "final", 39.0, 39.5)
    relight = [s for s in _left(folder, ["final"], (4, 16)) if s.kind == "relight"]
    alone = [s for s in _left(folder, ["final"], (16,)) if s.kind == "relight"]
    # Those with 4 samples are there already.
    assert relight[0].work == alone[0].work == 2 * 16 * 100 * 3
    _relit(folder, "final", 42.0, 43.0, 16)
    assert _left(folder, ["final"], (4, 16)) == []
    page = tmp_path / "page.md"
    write_page(page, [folder])
    rows = [r for r in page.read_text("utf-8").splitlines() if r.startswith("| hall | final")]
    assert [row.split(" | ")[2] for row in rows] == ["4", "16"]
    assert "42.0 / 42.0 (43.0)" in rows[1]


def test_pictures_are_made_again_of_the_samples_that_are_asked_for(folder: Path) -> None:
    for samples in (4, 16):
        _relit(folder, "final", 39.0, 39.5, samples)
    forget_pictures(folder, "final", [16])
    assert _left(folder, ["final"], (4,)) == []
    assert "relight" in [step.kind for step in _left(folder, ["final"], (16,))]


def test_a_sheet_has_each_views_finest_picture(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for samples in (4, 16):
        _relit(folder, "final", 39.0, 39.5, samples)
    # The second view was not measured with more.
    (picture_folder(folder, "final", "Other 2", 16) / "figures.json").unlink()
    for view in VIEWS:
        (folder / view).mkdir()
        (folder / view / "reference.png").touch()
    drawn: list[Row] = []
    monkeypatch.setattr(scene_table, "write_sheet", lambda *args: drawn.extend(args[3]))
    draw_sheets([folder])
    pictures = [row.cells[1].picture for row in drawn]
    finest = (("Other 1", 16), ("Other 2", 4))
    assert pictures == [picture_folder(folder, "final", *each) / "relit.png" for each in finest]


def test_equal_pictures_count_as_infinitely_near(folder: Path, tmp_path: Path) -> None:
    _relit(folder, "draft", None, None)
    found = read_scenes([folder])[0].views[0]
    assert found.psnr.measured == found.psnr.noiseless == float("inf")
    write_page(tmp_path / "page.md", [folder])
    assert "inf" in (tmp_path / "page.md").read_text(encoding="utf-8")


def test_without_figures_there_is_no_page(folder: Path, tmp_path: Path) -> None:
    write_page(tmp_path / "page.md", [folder])
    draw_sheets([folder])
    assert not (tmp_path / "page.md").exists()
