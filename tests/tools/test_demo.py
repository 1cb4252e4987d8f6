# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's own judgement, and its scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from tools import demo, demo_scene
from tools.evaluation import describe_views
from tools.relit import read_scene


def view_report(**changes: Any) -> dict[str, Any]:
    part = {"psnr_rgb": 40.0, "psnr_luma": 41.0, "flip": 0.02, "rel_mse": 0.001}
    report = {
        "view": "frame 001",
        "whole": dict(part),
        "away_from_edges": dict(part),
        "hole_fraction": 0.001,
        "reference": {
            "noise_floor": {"whole": {"psnr_luma": 45.0}, "away_from_edges": {"psnr_luma": 46.0}},
            "noise_is_low_enough": False,
        },
    }
    for path, value in changes.items():
        *outer, last = path.split("__")
        place: Any = report
        for key in outer:
            place = place[key]
        place[last] = value
    return report


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"whole__psnr_luma": 29.99}, "less than 30"),
        ({"away_from_edges__psnr_luma": 35.9}, "less than 36"),
        ({"hole_fraction": 0.01}, "1.00 % holes"),
        ({"reference__noise_floor__whole__psnr_luma": 35.9}, "too noisy, 35.90 dB"),
        ({"reference__noise_floor__away_from_edges__psnr_luma": 41.9}, "too noisy, 41.90 dB"),
    ],
)
def test_each_missed_target_is_named(changes: dict[str, Any], words: str) -> None:
    missed = demo.missed_targets([view_report(), view_report(**changes)])
    assert len(missed) == 1
    assert words in missed[0]


def test_figures_that_reach_their_targets_are_not_missed() -> None:
    # An empty mask or equal pictures have no figure to miss.
    views = [view_report(), view_report(away_from_edges__psnr_luma=None)]
    assert demo.missed_targets(views) == []
    assert "frame 001" in describe_views(views)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("demo") / "room.blend"
    demo_scene.build(path)
    return path


def test_the_room_has_what_a_demo_should_show(room: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(room))
    arrays = read_scene(bpy.context.scene)
    assert 10_000 < len(arrays.geometry) < 60_000
    assert {light.type for light in arrays.lights} == {"POINT", "SPOT", "SUN"}
    assert len(arrays.geometry.cutouts) == 2
    assert arrays.warnings == ()
    assert set(demo_scene.LIGHT_EDITS) <= {light.name for light in arrays.lights}
    size = np.ptp(arrays.geometry.bounds, axis=0)
    assert (size > 2.0).all()
    assert (size < 7.0).all()


def test_the_room_is_the_same_each_time(room: Path, tmp_path: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(room))
    first = read_scene(bpy.context.scene).geometry
    demo_scene.build(tmp_path / "again.blend")
    second = read_scene(bpy.context.scene).geometry
    np.testing.assert_array_equal(first.vertices, second.vertices)
    np.testing.assert_array_equal(first.material_id, second.material_id)


def test_the_camera_moves_between_the_frames_of_the_shot(room: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(room))
    scene = bpy.context.scene
    places = []
    for frame in demo_scene.SHOT_FRAMES:
        scene.frame_set(frame)
        places.append(np.array(scene.camera.matrix_world.translation))
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert len(places) == len(demo_scene.SHOT_FRAMES) > 1
    assert steps.min() > 0.3
