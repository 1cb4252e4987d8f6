# SPDX-License-Identifier: GPL-3.0-or-later
"""Budgets and the shot's choice, as words on a command line."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import bpy
import pytest

from addon.camplace.settings import PlacementSettings
from addon.place_arguments import add_place_arguments, placement_settings, shot_choice
from addon.scene.shot import ALL_CAMERAS, ShotChoice
from tests.tools.conftest import Run
from tests.tools.test_bad_input import assert_refused, save_scene


def parsed(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_place_arguments(parser)
    return parser.parse_args(words)


def test_without_words_the_settings_are_their_own_defaults() -> None:
    # The default preset's texels are what cameras are judged by.
    assert placement_settings(parsed()) == PlacementSettings(max_resolution=1024)
    assert shot_choice(parsed()) == ALL_CAMERAS


def test_words_become_settings() -> None:
    words = "--max-pictures 3 --max-texels 9999999 --max-megabytes 12.5 --view-share 0.5 --seed 4"
    words += " --preset draft"
    assert placement_settings(parsed(*words.split())) == PlacementSettings(
        seed=4, cameras=3, texels=9_999_999, megabytes=12.5, view_share=0.5, max_resolution=512
    )
    numbers = placement_settings(parsed("--primaries", "2", "--secondaries", "0"))
    assert (numbers.primaries, numbers.secondaries, numbers.budgeted) == (2, 0, False)
    assert shot_choice(parsed("--shot", "A, B C")) == ShotChoice(names=("A", "B C"))
    assert shot_choice(parsed("--active-camera")) == ShotChoice(active=True)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--max-pictures 4 --primaries 1", "--primaries: not together with --max-pictures"),
        ("--secondaries 8 --max-megabytes 9", "--max-megabytes: not together with --secondaries"),
        ("--max-pictures 0", "0 is less than 1"),
        ("--max-texels 1e6", "'1e6' is not a whole number"),
        ("--max-megabytes nan", "'nan' is not a number"),
        ("--max-megabytes 0", "0 is not above 0"),
        ("--view-share 1.1", "1.1 is not between 0 and 1"),
        ("--view-share inf", "'inf' is not a number"),
        ("--shot ,", "',' names nothing"),
        ("--shot A --active-camera", "not allowed with argument --shot"),
    ],
)
def test_words_that_cannot_be_used(
    words: str, message: str, tmp_path: Path, relume_here: Run
) -> None:
    run = relume_here("place", tmp_path / "absent.blend", *words.split())
    assert (run.returncode, run.stdout) == (2, "")
    assert message in run.stderr.rstrip().rpartition("\n")[2]


@pytest.mark.parametrize("words", ["--max-megabytes 3", "--max-texels 65535"])
def test_a_budget_below_one_picture_is_told_before_the_work(
    words: str, tmp_path: Path, relume_here: Run
) -> None:
    run = relume_here("place", tmp_path / "absent.blend", *words.split())
    assert_refused(run, "must be at least", "one picture of 256 x 256")


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A floor seen by a camera, and by another one from its other end."""
    path = save_scene(tmp_path_factory.mktemp("budget") / "scene.blend")
    other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
    other.location = (1.0, 0.0, 3.0)
    bpy.context.scene.collection.objects.link(other)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.mark.parametrize(
    "words", ["--max-pictures 1", "--max-texels 600000", "--max-megabytes 3.3"]
)
def test_budgets_are_kept(scene: Path, words: str, relume_here: Run) -> None:
    run = relume_here("place", scene, "--json", *words.split())
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    option, limit = words.split()
    spent = {
        "--max-pictures": len(report["cameras"]),
        "--max-texels": report["texels"],
        "--max-megabytes": report["texels"] * 50 / 1e6,
    }
    assert 0 < spent[option] <= float(limit)


def test_cameras_are_placed_for_the_shot_that_was_named(scene: Path, relume_here: Run) -> None:
    words = ("place", scene, "--max-pictures", 2)
    run = relume_here(*words, "--shot", "Other", "--json")
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["shot"] == ["Other"]
    assert "for 2 views of 'Camera', 'Other': " in relume_here(*words).stdout
    assert "for 1 view of 'Camera': " in relume_here(*words, "--active-camera").stdout
    run = relume_here(*words, "--shot", "Other,Nobody")
    assert_refused(run, "no camera 'Nobody'; it has: Camera, Other")
