# SPDX-License-Identifier: GPL-3.0-or-later
"""The batch script as a farm starts it: a process of its own, its lines and its exit status."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.caching.store import CacheStore
from addon.camplace.cameras_file import to_json
from tests.caching.material_grid import add_plane, camera_above, empty_material, empty_scene
from tests.caching.test_materials import glass

ROOT = Path(__file__).resolve().parent.parent.parent


def bake_cache(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, ROOT / "tools" / "bake_cache.py", *map(str, words)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def events(run: subprocess.CompletedProcess[str]) -> list[dict[str, Any]]:
    """The lines of JSON among what Blender itself prints."""
    return [json.loads(line) for line in run.stdout.splitlines() if line.startswith("{")]


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A scene's file and a placement of two cameras for it."""
    folder = tmp_path_factory.mktemp("shot")
    scene = empty_scene()
    add_plane(scene, "floor", (0.0, 0.0, 0.0), empty_material("floor")[0], size=4.0)
    add_plane(scene, "pane", (0.0, 0.0, 1.0), glass())
    path = folder / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    cameras = tuple(camera_above((0, 0, 0), 3.0, number=number) for number in (0, 1))
    placement = folder / "cameras.json"
    placement.write_text(json.dumps(to_json(cameras)))
    return path, placement


def test_bakes_in_parts_and_tells_its_progress(shot: tuple[Path, Path], tmp_path: Path) -> None:
    scene, placement = shot
    contents = scene.read_bytes()
    words = (scene, "--cache", tmp_path / "c", "--placement", placement, "--preset", "draft")
    run = bake_cache(*words, "--cameras", "1")
    assert run.returncode == 0, run.stderr
    assert [camera.id for camera in CacheStore.open(tmp_path / "c").cameras] == [1]
    # Named for the artist, on standard error.
    assert "'window'" in run.stderr
    *steps, last = events(run)
    shares = [step["progress"] for step in steps if "progress" in step]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert any(step.get("message") == "Baking camera 1 of 1" for step in steps)
    result = last["result"]
    assert result["baked"] == 1
    assert set(result["seconds"]) == {
        "prepare", "cycles", "read", "finish", "sight", "write",
    }  # fmt: skip
    assert all(0.0 <= seconds < 60.0 for seconds in result["seconds"].values())
    assert result["seconds"]["cycles"] > 0.0
    depth = result["channels"]["table"][0]
    assert (depth["name"], depth["cameras_by_precision"]) == ("depth", {"float32": 1})
    assert result["texels"] * result["bytes_per_texel"]["raw"] == result["raw_bytes"]
    assert any(item["approximated"] for item in result["materials"] if item["name"] == "window")

    run = bake_cache(*words, "--resume")
    assert run.returncode == 0, run.stderr
    result = events(run)[-1]["result"]
    assert (result["kept"], result["baked"]) == (1, 1)
    assert len(CacheStore.open(tmp_path / "c").read_finished()) == 2
    assert scene.read_bytes() == contents


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("missing.blend", "--cache", "c"), "missing.blend"),
        (("--cache", "c"), "name the .blend file first"),
    ],
)
def test_input_that_cannot_be_used(words: tuple[str, ...], message: str) -> None:
    run = bake_cache(*words)
    assert run.returncode == 2
    assert message in run.stderr
    assert "Traceback" not in run.stderr


def test_unknown_camera_ids(shot: tuple[Path, Path], tmp_path: Path) -> None:
    scene, placement = shot
    run = bake_cache(scene, "--cache", tmp_path / "c", "--placement", placement, "--cameras", "0-7")
    assert run.returncode == 2
    assert "there is no caching camera 2" in run.stderr
    assert "error" in events(run)[-1]


def test_a_range_of_far_too_many_cameras(tmp_path: Path, shot: tuple[Path, Path]) -> None:
    run = bake_cache(shot[0], "--cache", tmp_path / "c", "--cameras", "0-99999999999")
    assert run.returncode == 2
    assert "99,999" in run.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_bake_keeps_what_is_finished_and_leaves_no_temporary_files(
    shot: tuple[Path, Path], tmp_path: Path, number: signal.Signals
) -> None:
    # Many of them, so that the signal comes while one is rendered.
    cameras = tuple(camera_above((0, 0, 0), 3.0, number=number) for number in range(500))
    placement = tmp_path / "cameras.json"
    placement.write_text(json.dumps(to_json(cameras)))
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    words = ("--cache", tmp_path / "c", "--placement", placement, "--preset", "draft")
    process = subprocess.Popen(
        [sys.executable, ROOT / "tools" / "bake_cache.py", shot[0], *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"TMPDIR": str(temporary)},
    )
    assert process.stdout is not None
    third = next(line for line in process.stdout if "Baking camera 3 of 500" in line)
    assert json.loads(third)["message"].endswith(" left")
    process.send_signal(number)
    told, errors = process.communicate(timeout=60)
    assert process.returncode == 1
    assert json.loads(told.splitlines()[-1]) == {"error": "stopped"}
    assert errors.splitlines()[-1] == "relume: stopped"
    assert "Traceback" not in errors
    assert 2 <= len(CacheStore.open(tmp_path / "c").read_finished()) < len(cameras)
    assert not list(temporary.iterdir())
    assert not list((tmp_path / "c").rglob("*.part"))
