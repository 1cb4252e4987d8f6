# SPDX-License-Identifier: GPL-3.0-or-later
"""An animation and an edit from the command line."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import bpy
import pytest

from addon.caching.fingerprint import scene_fingerprint
from addon.caching.frame_state import FramePicture
from addon.caching.store import CacheStore
from addon.camplace.cameras_file import write_cameras
from addon.errors import InputError
from tests.caching.material_grid import geometry_of_scene
from tests.caching.test_frames import move_the_ball
from tests.caching.two_rooms import ALL, LEFT, RIGHT, assert_same, bake, cameras, two_rooms
from tests.tools.conftest import Run

SMALL = ("--size", "32x24", "--samples", "1")


@pytest.fixture
def rooms(tmp_path: Path) -> tuple[Path, Path]:
    """The two rooms with a ball that moves at frames 3 and 5, lit and with a view; and where the
    cameras are."""
    scene = two_rooms()
    move_the_ball()
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location = (-2.1, 0.0, 1.5)
    view = bpy.data.objects.new("View", bpy.data.cameras.new("View"))
    view.location = (-2.1, 0.0, 1.0)
    for obj in (lamp, view):
        scene.collection.objects.link(obj)
    scene.camera = view
    path = tmp_path / "rooms.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    write_cameras(tmp_path / "cameras.json", tuple(cameras()))
    return path, tmp_path / "cameras.json"


def words(rooms: tuple[Path, Path], cache: Path, *more: object) -> tuple[object, ...]:
    scene, placed = rooms
    return ("bake", scene, "--cache", cache, "--preset", "draft", "--placement", placed, *more)


def test_frames_are_baked_and_shown(
    rooms: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    run = relume_here(*words(rooms, tmp_path / "c", "--frames", "1-4", "--json"))
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    assert report["baked"] == len(ALL)
    assert report["frames"] == {"2": [], "3": [LEFT], "4": []}

    show = ("relight", rooms[0], "--cache", tmp_path / "c", "--out", tmp_path / "out.png", *SMALL)
    run = relume_here(*show, "--frame", "3", "--json")
    assert run.returncode == 0, run.stderr
    assert json.loads(run.stdout)["frame"] == 3
    (tmp_path / "out.png").unlink()
    run = relume_here(*show, "--frame", "5")
    assert run.returncode == 2
    assert "does not hold frame 5" in run.stderr
    assert "holds the frames 1-4" in run.stderr
    assert not (tmp_path / "out.png").exists()

    # At whatever frame the file was saved, the cache's first one stays so.
    bpy.ops.wm.open_mainfile(filepath=str(rooms[0]))
    bpy.context.scene.frame_set(3)
    bpy.ops.wm.save_mainfile()
    run = relume_here(*words(rooms, tmp_path / "c", "--resume", "--json"))
    report = json.loads(run.stdout)
    assert (report["baked"], report["kept"], report["changed"]) == (0, len(ALL), [])
    assert any("first frame, 1," in warning for warning in report["warnings"])
    run = relume_here(*words(rooms, tmp_path / "c", "--resume", "--frames", "5,6", "--json"))
    assert json.loads(run.stdout)["frames"] == {"5": [LEFT, RIGHT], "6": []}
    assert relume_here(*show, "--frame", "5").returncode == 0


def test_an_edit_says_what_it_was(
    rooms: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    assert relume_here(*words(rooms, tmp_path / "c")).returncode == 0
    bpy.ops.wm.open_mainfile(filepath=str(rooms[0]))
    bpy.data.objects["Ball right"].location.z += 0.1
    bpy.ops.wm.save_mainfile()
    run = relume_here(*words(rooms, tmp_path / "c"))
    assert run.returncode == 2
    assert "--resume" in run.stderr
    run = relume_here(*words(rooms, tmp_path / "c", "--resume", "--json"))
    report = json.loads(run.stdout)
    assert (report["baked"], report["kept"]) == (1, len(ALL) - 1)
    assert report["changed"] == ["object 'Ball right'"]
    assert report["again"] == {str(RIGHT): ["object 'Ball right'"]}


@pytest.mark.parametrize("frames", ["", "a", "1-", "3-1", "1,,2", "9999999"])
def test_frames_that_cannot_be(
    rooms: tuple[Path, Path], tmp_path: Path, frames: str, relume_here: Run
) -> None:
    run = relume_here(*words(rooms, tmp_path / "c", f"--frames={frames}"))
    assert run.returncode == 2
    assert not (tmp_path / "c").exists()


def cached_frames(cache: Path) -> Mapping[str, FramePicture]:
    try:
        return CacheStore.open(cache).manifest.pictures
    except InputError:  # not begun yet
        return {}


def test_killed_between_frames(rooms: tuple[Path, Path], tmp_path: Path) -> None:
    """What is finished is kept, what is not is baked, and nothing is mixed up."""
    cache = tmp_path / "c"
    command = [str(word) for word in words(rooms, cache, "--frames", "1-6", "--resume")]
    child = subprocess.Popen(
        [sys.executable, "-m", "tools.relume", *command],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    while child.poll() is None and len(cached_frames(cache)) < 2:
        time.sleep(0.002)
    child.send_signal(signal.SIGKILL)
    child.wait()
    finished = set(cached_frames(cache))
    subprocess.run([sys.executable, "-m", "tools.relume", *command], check=True)
    store = CacheStore.open(cache)
    assert finished <= set(store.manifest.pictures)
    bpy.ops.wm.open_mainfile(filepath=str(rooms[0]))
    scene = bpy.context.scene
    for frame in (3, 5):
        scene.frame_set(frame)
        bake(scene, tmp_path / str(frame))
        fresh = CacheStore.open(tmp_path / str(frame))
        fingerprint = scene_fingerprint(geometry_of_scene(scene))
        assert_same(store.showing(fingerprint, frame), fresh)
