# SPDX-License-Identifier: GPL-3.0-or-later
"""Place and Bake leave the artist's session alone."""

from __future__ import annotations

import argparse
import errno
import json
import os
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from addon.caching.edited_cameras import PLACEMENT_NAME
from addon.caching.manifest import Manifest
from addon.caching.plan import ChannelPlan
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera
from addon.camplace.cameras_file import read_cameras, write_cameras
from addon.camplace.settings import PlacementSettings
from addon.errors import InputError
from addon.place_arguments import add_place_arguments, placement_settings, shot_choice
from addon.scene.shot import ALL_CAMERAS, ShotChoice
from addon.ui import job
from addon.ui.camera_objects import show_cameras


def session_state() -> dict[str, Any]:
    scene: Any = bpy.context.scene
    render = scene.render
    return {
        "dirty": bpy.data.is_dirty,
        "path": bpy.data.filepath,
        "selected": [obj.name for obj in bpy.context.view_layer.objects if obj.select_get()],
        "frame": scene.frame_current,
        "engine": render.engine,
        "size": (render.resolution_x, render.resolution_y),
        "aovs": len(bpy.context.view_layer.aovs),
        "scenes": [scene.name for scene in bpy.data.scenes],
        "materials": [material.name for material in bpy.data.materials],
    }


def test_the_copy_changes_nothing_here(extension: None, tmp_path: Path) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    before = session_state()
    copy = job.save_copy(tmp_path)  # the same name: the copy must still be a copy
    assert copy.exists()
    assert session_state() == before


def test_an_unsaved_session_can_be_copied(extension: None, tmp_path: Path) -> None:
    before = session_state()
    assert job.save_copy(tmp_path).exists()
    assert session_state() == before
    assert before["path"] == ""


def test_relative_paths_lead_to_the_same_file_from_the_copy(
    extension: None, tmp_path: Path
) -> None:
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    image = bpy.data.images.new("wood", 2, 2)
    image.filepath_raw = "//wood.png"
    image.file_format = "PNG"
    image.save()
    image.source = "FILE"
    image.use_fake_user = True
    other = tmp_path / "deep" / "folder"
    other.mkdir(parents=True)
    copy = job.save_copy(other)
    assert bpy.data.images["wood"].filepath == "//wood.png"
    bpy.ops.wm.open_mainfile(filepath=str(copy))
    resolved = Path(bpy.path.abspath(bpy.data.images["wood"].filepath)).resolve()
    assert resolved == (tmp_path / "wood.png").resolve()


def test_the_request_survives_the_command_line(extension: None, tmp_path: Path) -> None:
    words = ["--cache", str(tmp_path / "with space 'and' quotes")]
    command = job.command(tmp_path / "a b.blend", [("bake", words)])
    request = json.loads(command[-1])
    assert command[-2] == "--"
    assert request["steps"] == [["bake", words]]
    assert request["blend"] == str(tmp_path / "a b.blend")


def test_only_one_at_a_time(
    extension: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(job, "command", lambda *_: ["sleep", "60"])
    scene: Any = bpy.context.scene
    first = job.start("Placing", scene, tmp_path, [])
    with pytest.raises(InputError, match="already"):
        job.start("Baking", scene, tmp_path, [])
    scene.relume.cache_folder = str(tmp_path)
    assert not bpy.ops.relume.bake.poll()
    job.stop_current()
    assert first.error == "stopped"
    assert job.current() is None
    assert bpy.ops.relume.bake.poll()


def test_stopping_leaves_nothing_half_written(
    extension: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    write = f'cd "{tmp_path}"; mkdir cameras; echo x > cameras/.0001.exr.$$.part; exec sleep 60'
    monkeypatch.setattr(job, "command", lambda *_: ["sh", "-c", write])
    (tmp_path / ".0002.exr.1.part").touch()  # another process's
    started = job.start("Baking", bpy.context.scene, tmp_path, [])
    end = time.monotonic() + 20.0
    while not list(tmp_path.rglob(".0001*.part")):
        assert time.monotonic() < end
        time.sleep(0.01)
    started.stop()
    assert [path.name for path in tmp_path.rglob("*.part")] == [".0002.exr.1.part"]


def test_temporary_files_of_a_killed_child_go_with_the_job(
    extension: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    leave = f'mkdir "$TMPDIR/blender_x"; echo "$TMPDIR" > "{tmp_path}/where"; exec sleep 60'
    monkeypatch.setattr(job, "command", lambda *_: ["sh", "-c", leave])
    started = job.start("Baking", bpy.context.scene, tmp_path, [])
    where, end = tmp_path / "where", time.monotonic() + 20.0
    while not (where.exists() and where.read_text()):
        assert time.monotonic() < end
        time.sleep(0.01)
    folder = Path(where.read_text().strip())
    assert folder.is_dir()
    started.stop()
    assert not folder.parent.exists()


def test_a_failure_is_told_in_the_childs_own_words(
    extension: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    say = 'echo Blender; echo \'{"error": "the disk is full"}\'; exit 2'
    monkeypatch.setattr(job, "command", lambda *_: ["sh", "-c", say])
    scene: Any = bpy.context.scene
    scene.relume.cache_folder = str(tmp_path)
    with pytest.raises(RuntimeError, match="the disk is full"):
        bpy.ops.relume.bake()


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("mkdtemp", r"no folder for temporary files can be made \(No space left"),
        ("Popen", "cannot be started in the background: No space left"),
    ],
)
def test_a_job_that_cannot_start_is_told_and_leaves_nothing(
    extension: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, place: str, words: str
) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    module = {"mkdtemp": "tempfile", "Popen": "subprocess"}[place]
    scene: Any = bpy.context.scene
    scene.relume.cache_folder = str(tmp_path / "cache")
    monkeypatch.setattr(f"{module}.{place}", full)
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.relume.bake()
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_told_before_the_work(
    extension: None, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    scene: Any = bpy.context.scene
    scene.relume.cache_folder = str(tmp_path / "file" / "cache")
    for start in (bpy.ops.relume.place, bpy.ops.relume.bake):
        with pytest.raises(RuntimeError, match="cannot be written: Not a directory"):
            start()


def test_place_needs_a_camera_and_a_folder(extension: None, tmp_path: Path) -> None:
    scene: Any = bpy.context.scene
    assert not bpy.ops.relume.place.poll()
    scene.relume.cache_folder = str(tmp_path)
    assert bpy.ops.relume.place.poll()
    bpy.data.objects.remove(scene.camera)
    assert not bpy.ops.relume.place.poll()


def test_place_in_the_background(extension: None, tmp_path: Path) -> None:
    scene: Any = bpy.context.scene
    scene.relume.cache_folder = str(tmp_path / "cache")
    scene.relume.primaries, scene.relume.secondaries = 1, 1
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    before = session_state()
    assert bpy.ops.relume.place() == {"FINISHED"}
    cameras = read_cameras(tmp_path / "cache" / PLACEMENT_NAME)
    assert len(cameras) >= 2
    shown = bpy.data.collections["Relume Cameras"].objects
    assert sum(obj.type == "CAMERA" for obj in shown) == len(cameras)
    after = session_state()
    # The new collection is an edit of the file, which asks to be saved.
    del before["dirty"], after["dirty"]
    assert after == before


def test_bake_in_the_background_places_first_and_then_keeps_what_is_there(
    extension: None, tmp_path: Path
) -> None:
    scene: Any = bpy.context.scene
    folder = tmp_path / "cache"
    scene.relume.cache_folder = str(folder)
    scene.relume.primaries, scene.relume.secondaries, scene.relume.preset = 1, 0, "draft"
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    before = session_state()
    assert bpy.ops.relume.bake() == {"FINISHED"}
    assert session_state() == before
    store = CacheStore.open(folder)
    placed = read_cameras(folder / PLACEMENT_NAME)
    assert len(store.cameras) == len(placed) > 0
    files = {path.name: path.stat().st_mtime_ns for path in folder.rglob("*.exr")}
    assert len(files) == len(placed)
    # Nothing changed, so nothing is baked again; and no half-written file is about.
    assert bpy.ops.relume.bake() == {"FINISHED"}
    assert {path.name: path.stat().st_mtime_ns for path in folder.rglob("*.exr")} == files
    assert not list(folder.rglob("*.part"))


def test_bake_takes_what_the_artist_did_to_the_cameras(
    extension: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(job, "command", lambda *_: ["true"])
    scene: Any = bpy.context.scene
    scene.relume.cache_folder = str(tmp_path / "cache")
    path = tmp_path / "cache" / PLACEMENT_NAME
    path.parent.mkdir()
    placed = tuple(
        CachingCamera(number, np.eye(4), 1.0, 0.1, 50.0, 512, "PERSPECTIVE", number)
        for number in range(3)
    )
    write_cameras(path, placed)
    show_cameras(scene, placed)
    written = path.stat().st_mtime_ns
    assert bpy.ops.relume.bake() == {"FINISHED"}
    assert path.stat().st_mtime_ns == written  # nothing was edited

    bpy.data.objects["Relume 0001 View 1"].location.x = 3.0
    bpy.data.objects.remove(bpy.data.objects["Relume 0002 View 2"])
    own = bpy.data.objects.new("Own", bpy.data.cameras.new("Own"))
    bpy.data.collections["Relume Cameras"].objects.link(own)
    assert bpy.ops.relume.bake() == {"FINISHED"}
    cameras = read_cameras(path)
    assert [camera.id for camera in cameras] == [0, 1, 3]
    assert cameras[0].to_json() == placed[0].to_json()
    assert cameras[1].origin.tolist() == [3.0, 0.0, 0.0]
    assert cameras[2].kind == "PERSPECTIVE"


def test_what_a_farm_baked_of_an_edit_is_current_in_the_panel(
    extension: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Another computer read the moved camera with other last bits, and at a preset's size."""
    monkeypatch.setattr(job, "command", lambda *_: ["true"])
    scene: Any = bpy.context.scene
    scene.relume.cache_folder = str(tmp_path)
    path = tmp_path / PLACEMENT_NAME
    placed = CachingCamera(0, np.eye(4), 1.0, 0.1, 50.0, 1024, "PERSPECTIVE", 0)
    write_cameras(path, (placed,))
    show_cameras(scene, (placed,))
    moved = np.eye(4)
    moved[0, 3] = np.float32(0.3)
    bpy.data.objects["Relume 0000 View 0"].location.x = moved[0, 3]
    moved[0, 3] = np.nextafter(moved[0, 3], 1.0)
    baked = replace(placed, world_from_camera=moved, resolution=512)
    plan = ChannelPlan(("depth",), {}, (), ())
    CacheStore.create(tmp_path, Manifest("0" * 64, {"preset": "draft"}, plan, (baked,)))
    assert bpy.ops.relume.bake() == {"FINISHED"}
    (read,) = read_cameras(path)
    assert read.to_json() == {**baked.to_json(), "resolution": 1024}


def test_placing_again_keeps_the_artists_own_cameras(
    extension: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The placement itself is stood in for: its result is a file here."""
    scene: Any = bpy.context.scene
    scene.relume.cache_folder = str(tmp_path)
    path = tmp_path / PLACEMENT_NAME

    def stood(number: int, x: float) -> CachingCamera:
        matrix = np.eye(4)
        matrix[0, 3] = x
        return CachingCamera(number, matrix, 1.0, 0.1, 50.0, 512, "PERSPECTIVE", number)

    write_cameras(path, (stood(0, 0.0), stood(1, 1.0)))
    show_cameras(scene, read_cameras(path))
    collection = bpy.data.collections["Relume Cameras"]
    for x in (5.0, 6.0):
        own = bpy.data.objects.new(f"Own {x:.0f}", bpy.data.cameras.new("Own"))
        own.location.x = x
        collection.objects.link(own)
    given: list[tuple[CachingCamera, ...]] = []

    def place(_blend: Path, steps: Any) -> list[str]:
        ((_, words),) = steps
        earlier = read_cameras(Path(words[words.index("--keep-from") + 1]))
        given.append(earlier)
        # Number 3, the artist's second one, did not earn its place, and its number is free.
        write_cameras(path, (earlier[0], earlier[2], stood(3, 9.0)))
        return ["true"]

    monkeypatch.setattr(job, "command", place)
    assert bpy.ops.relume.place() == {"FINISHED"}
    assert [camera.origin[0] for camera in given[0]] == [0.0, 1.0, 5.0, 6.0]
    places = sorted(o.matrix_basis.translation.x for o in collection.objects if o.type == "CAMERA")
    assert places == [0.0, 5.0, 6.0, 9.0]
    # The next bake takes all of them, and the kept ones under the numbers that they had.
    monkeypatch.setattr(job, "command", lambda *_: ["true"])
    bpy.ops.relume.bake()
    numbers = {camera.id: camera.origin[0] for camera in read_cameras(path)}
    assert numbers == {0: 0.0, 2: 5.0, 3: 9.0, 4: 6.0}
    scene.relume.keep_cameras = False
    monkeypatch.setattr(job, "command", lambda _, steps: ["echo", json.dumps({"error": steps})])
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.relume.place()
    assert "--out" in str(caught.value)
    assert "--keep-from" not in str(caught.value)


def test_placing_for_a_box_of_interest(
    extension: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    scene: Any = bpy.context.scene
    scene.relume.cache_folder = str(tmp_path)
    scene.relume.box_object = bpy.data.objects["Cube"]
    started: list[Any] = []

    def remember(_blend: Path, steps: Any) -> list[str]:
        started.extend(steps)
        return ["false"]

    monkeypatch.setattr(job, "command", remember)
    with pytest.raises(RuntimeError):
        bpy.ops.relume.place()
    ((verb, words),) = started
    assert verb == "place"
    assert words[words.index("--box-object") + 1] == "Cube"


@pytest.mark.parametrize(
    ("budget", "wanted"),
    [
        ("CAMERAS", PlacementSettings(primaries=2, secondaries=3, view_share=0.3)),
        ("PICTURES", PlacementSettings(cameras=5, view_share=0.3)),
        ("MEMORY", PlacementSettings(megabytes=70.0, view_share=0.3)),
    ],
)
def test_the_panels_budget_reaches_the_placement(
    extension: None,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    budget: str,
    wanted: PlacementSettings,
) -> None:
    settings = bpy.context.scene.relume
    settings.cache_folder = str(tmp_path)
    settings.budget = budget
    settings.primaries, settings.secondaries, settings.shot_share = 2, 3, 0.3
    settings.max_pictures, settings.max_megabytes = 5, 70
    for shot, choice in (("ALL", ALL_CAMERAS), ("ACTIVE", ShotChoice(active=True))):
        settings.shot = shot
        started: list[Any] = []

        def remember(_blend: Path, steps: Any, into: list[Any] = started) -> list[str]:
            into.extend(steps)
            return ["false"]

        monkeypatch.setattr(job, "command", remember)
        with pytest.raises(RuntimeError):
            bpy.ops.relume.place()
        ((_, words),) = started
        parser = argparse.ArgumentParser()
        parser.add_argument("--out")
        add_place_arguments(parser)
        args = parser.parse_args(words)
        # The preset in the panel is the balanced one.
        assert placement_settings(args) == replace(wanted, max_resolution=1024)
        assert shot_choice(args) == choice


def test_placing_within_a_budget_for_the_active_camera(extension: None, tmp_path: Path) -> None:
    scene: Any = bpy.context.scene
    scene.relume.cache_folder = str(tmp_path / "cache")
    scene.relume.budget, scene.relume.max_pictures, scene.relume.shot = "PICTURES", 3, "ACTIVE"
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    assert bpy.ops.relume.place() == {"FINISHED"}
    assert 0 < len(read_cameras(tmp_path / "cache" / PLACEMENT_NAME)) <= 3
