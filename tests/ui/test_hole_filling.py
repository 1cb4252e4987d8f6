# SPDX-License-Identifier: GPL-3.0-or-later
"""Holes are filled in the background, and what was baked is kept or let go as the artist says."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import bpy
import numpy as np
import pytest

from addon.caching.bake import BakeSettings, bake_scene
from addon.caching.edited_cameras import PLACEMENT_NAME
from addon.caching.store import CacheStore
from addon.caching.temporary_store import FOLDER_NAME, temporary_pictures
from addon.camplace.camera import CachingCamera
from addon.camplace.cameras_file import read_cameras, write_cameras
from addon.camplace.hole_cameras import HolePoints, hole_cameras
from addon.errors import InputError
from addon.progress import silent
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.ui import hole_filler, hole_job, hole_render, job
from addon.ui.camera_objects import show_cameras
from addon.ui.event_loop import call_later
from addon.ui.hole_filler import STILL_S, HoleFiller
from addon.ui.lacking_points import LEAST_OPEN, lacking_points
from addon.ui.scene_changes import SceneChanges
from tests import synthetic
from tests.ui.test_job import session_state


@pytest.fixture
def scene(extension: None, gpu_context: None, tmp_path: Path) -> Iterator[Any]:
    """The factory file's cube on a floor, baked from one camera behind the cube."""
    scene: Any = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=30.0, location=(0.0, 0.0, -1.0))
    render = scene.render
    render.engine = "RELUME"
    render.resolution_x, render.resolution_y, render.resolution_percentage = 64, 40, 100
    scene.relume.render_samples = 1
    folder = tmp_path / "shot.relume"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    place = synthetic.looking_at((-6.0, 5.0, 5.0), (0.0, 0.0, 0.0))
    camera = CachingCamera(0, place, 1.2, 0.05, 60.0, 128, "PERSPECTIVE", 0)
    geometry = with_render_depsgraph(scene, read_geometry)
    bake_scene(scene, geometry, [camera], folder, BakeSettings("draft"))
    write_cameras(folder / PLACEMENT_NAME, (camera,))
    show_cameras(scene, (camera,))
    bpy.ops.wm.save_mainfile()
    yield scene
    hole_job.stop_current()


def folder_of(scene: Any) -> Path:
    return Path(bpy.data.filepath).with_suffix(".relume")


def render(scene: Any) -> None:
    bpy.ops.render.render()


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the temporary pictures of the scene's render are kept once they are baked."""
    return tmp_path_factory.mktemp("filled") / FOLDER_NAME


def fill(scene: Any, pictures: Path) -> None:
    """Put the pictures there that a render bakes for its holes: each test has the same scene."""
    place = folder_of(scene) / FOLDER_NAME
    if pictures.exists():
        shutil.copytree(pictures, place)
    else:
        render(scene)
        shutil.copytree(place, pictures)
    assert temporary_pictures(folder_of(scene))[0] == 1


def test_a_final_render_fills_its_holes_and_they_are_kept_or_let_go(
    scene: Any, pictures: Path
) -> None:
    folder = folder_of(scene)
    manifest = (folder / "manifest.json").read_bytes()
    before = session_state()
    scene.relume.fill_holes = False
    render(scene)
    assert temporary_pictures(folder) == (0, 0)
    scene.relume.fill_holes = True
    render(scene)
    count, size = temporary_pictures(folder)
    assert count == 1
    assert size > 0
    fill(scene, pictures)
    assert (folder / "manifest.json").read_bytes() == manifest
    # What is there serves the next render, and nothing else is baked for it.
    render(scene)
    assert temporary_pictures(folder)[0] == 1
    assert session_state() == before | {"dirty": session_state()["dirty"]}

    bpy.ops.relume.keep_filled()
    assert temporary_pictures(folder) == (0, 0)
    cameras = CacheStore.open(folder).cameras
    assert [camera.id for camera in cameras] == [0, 1]
    assert np.allclose(cameras[1].origin, scene.camera.matrix_world.translation)
    # The next bake takes it, and finds it as it is baked.
    assert [camera.to_json() for camera in read_cameras(folder / PLACEMENT_NAME)] == [
        camera.to_json() for camera in cameras
    ]
    shown = bpy.data.collections["Relume Cameras"].all_objects
    assert sum(obj.type == "CAMERA" for obj in shown) == 2
    render(scene)
    assert temporary_pictures(folder) == (0, 0)
    assert not bpy.ops.relume.discard_filled.poll()


def test_kept_cameras_stand_beside_those_that_are_not_baked_yet(scene: Any, pictures: Path) -> None:
    folder = folder_of(scene)
    fill(scene, pictures)
    (first,) = read_cameras(folder / PLACEMENT_NAME)
    placed = (first, *(replace(first, id=number, source=number) for number in (1, 2)))
    write_cameras(folder / PLACEMENT_NAME, placed)
    show_cameras(scene, placed)
    bpy.ops.relume.keep_filled()
    assert [camera.id for camera in CacheStore.open(folder).cameras] == [0, 3]
    assert [camera.id for camera in read_cameras(folder / PLACEMENT_NAME)] == [0, 1, 2, 3]


def test_pictures_that_do_not_fit_leave_the_cache_as_it_is(
    scene: Any, pictures: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from addon.corrmap.block_pages import BlockPages
    from addon.ui.scene_session import SceneSession

    fill(scene, pictures)

    def full(*_: Any) -> Any:
        raise InputError("the GPU has no room")

    monkeypatch.setattr(BlockPages, "grown", full)
    graph = bpy.context.evaluated_depsgraph_get()
    opened = SceneSession(graph, 1)
    assert any("the GPU has no room" in warning for warning in opened.warnings)
    opened.session.set_view(view_at(0.0))
    holes = opened.session.coverage.hole_fraction
    monkeypatch.undo()
    assert SceneSession(graph, 1).warnings == tuple(
        warning for warning in opened.warnings if "no room" not in warning
    )
    scene.relume.fill_holes = False
    bpy.ops.relume.discard_filled()
    alone = SceneSession(graph, 1)
    alone.session.set_view(view_at(0.0))
    assert alone.session.coverage.hole_fraction == holes > 0.0


def test_temporary_pictures_go_with_the_file(scene: Any, pictures: Path) -> None:
    folder = folder_of(scene)
    fill(scene, pictures)
    assert bpy.ops.relume.discard_filled.poll()
    bpy.ops.relume.discard_filled()
    assert temporary_pictures(folder) == (0, 0)
    render(scene)
    assert temporary_pictures(folder)[0] == 1
    bpy.ops.wm.read_homefile()
    assert temporary_pictures(folder) == (0, 0)


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def opened(folder: Path, open_fraction: float = 0.1) -> Any:
    """What a `HoleFiller` needs of a session."""
    points = HolePoints(np.array([[0.0, 0.0, -1.0], [0.3, 0.1, -1.0]]), np.array([True, True]))
    session = SimpleNamespace(
        coverage=SimpleNamespace(open_fraction=open_fraction), hole_points=lambda **_: points
    )
    return SimpleNamespace(session=session, stale=(), folder=folder)


def view_at(x: float) -> Any:
    return synthetic.perspective_view(
        synthetic.looking_at((x, -6.0, 3.0), (0.0, 0.0, 0.0)), 64, 40, 1.0
    )


def wait_for(filler: HoleFiller, seconds: float = 60.0) -> None:
    """Blender's event loop, which a module has none of."""
    end = time.monotonic() + seconds
    while filler._tick() is not None:
        assert time.monotonic() < end
        time.sleep(0.1)


def test_a_view_that_stands_still_has_its_holes_filled(
    scene: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hole_filler, "call_later", lambda *_: None)
    clock, folder = Clock(), folder_of(scene)
    filler = HoleFiller(clock)

    def follow(x: float, **how: Any) -> None:
        session = opened(folder, how.pop("open_fraction", 0.1))
        filler.follow(scene, session, view_at(x), is_whole=how.pop("is_whole", True))

    follow(0.0)
    follow(0.0)
    assert filler.status == ""
    clock.now += STILL_S + 0.01
    follow(0.0, is_whole=False)
    assert filler.status == ""
    # A row of pixels is no hole.
    follow(0.0, open_fraction=0.5 * LEAST_OPEN)
    assert filler.status == ""
    follow(1.0)
    clock.now += STILL_S + 0.01
    follow(1.0)
    assert filler.status == "filling holes"
    # It moves on before anything began, and then while it is being baked.
    follow(2.0)
    assert filler.status == ""
    clock.now += STILL_S + 0.01
    follow(2.0)
    filler._tick()
    job = hole_job.current()
    assert job is not None
    started = time.monotonic()
    follow(3.0)
    assert time.monotonic() - started < 0.5
    assert filler.status == ""
    end = time.monotonic() + 30.0
    while not job.done:
        assert time.monotonic() < end
        time.sleep(0.05)
    assert temporary_pictures(folder) == (0, 0)
    clock.now += STILL_S + 0.01
    follow(3.0)
    wait_for(filler)
    assert filler.status == ""
    assert temporary_pictures(folder)[0] == 1
    # Once is enough for a view; and nothing is done where the artist does not want it.
    follow(3.0)
    assert filler.status == ""
    scene.relume.fill_holes = False
    follow(4.0)
    clock.now += STILL_S + 0.01
    follow(4.0)
    assert filler.status == ""


def test_close_views_are_sharpened_where_the_artist_asks(
    scene: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hole_filler, "call_later", lambda *_: None)
    clock, asked = Clock(), []
    filler = HoleFiller(clock)

    def points(*, and_soft: bool) -> HolePoints:
        asked.append(and_soft)
        soft = np.arange(200) < how_many_soft
        return HolePoints(np.full((200, 3), -1.0), np.zeros(200, dtype=bool), soft)

    session = SimpleNamespace(coverage=SimpleNamespace(open_fraction=0.0), hole_points=points)
    whole: Any = SimpleNamespace(session=session, stale=(), folder=folder_of(scene))

    def follow(x: float) -> str:
        filler.follow(scene, whole, view_at(x), is_whole=True)
        clock.now += STILL_S + 0.01
        filler.follow(scene, whole, view_at(x), is_whole=True)
        return filler.status

    how_many_soft = 200
    assert follow(0.0) == ""
    assert asked == []
    # Asked while the view stands still, and once.
    scene.relume.sharpen_views = True
    assert follow(0.0) == "sharpening the view"
    assert follow(0.0) == "sharpening the view"
    assert asked == [True]
    # Edges of near things always are.
    how_many_soft = 1
    assert follow(1.0) == ""
    assert asked == [True, True]


def test_holes_among_soft_edges_are_baked_as_ever(scene: Any) -> None:
    view, edge = view_at(0.0), np.arange(200) < 1
    seen = np.random.default_rng(1).uniform((-0.3, -0.2, -2.0), (0.3, 0.2, -1.0), (200, 3))
    scene.relume.sharpen_views = True
    found = []
    for soft in (None, edge, ~edge):
        points = HolePoints(seen, np.arange(200) >= 150, soft)
        session: Any = SimpleNamespace(
            coverage=SimpleNamespace(open_fraction=0.1), hole_points=lambda *, p=points, **_: p
        )
        lacking = lacking_points(scene, session)
        assert lacking is not None
        found.append([camera.to_json() for camera in hole_cameras(view, lacking).cameras])
    assert found[1] == found[0]
    assert found[2] != found[0]


def test_a_final_render_sharpens_its_view(scene: Any) -> None:
    folder = folder_of(scene)
    # Each of the caching camera's texels is several pixels.
    scene.camera.location = (-2.5, 2.2, 1.8)
    direction = -scene.camera.location
    scene.camera.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
    render(scene)
    assert temporary_pictures(folder) == (0, 0)
    scene.relume.sharpen_views = True
    render(scene)
    count, _ = temporary_pictures(folder)
    assert count == 1
    render(scene)
    assert temporary_pictures(folder)[0] == count


class QuickJob:
    """In the place of a `HoleJob`: it is looked after three times, and bakes nothing."""

    error, message, is_superseded = "", "baking", False

    def __init__(self, _scene: Any, _cache: Path, cameras: Sequence[CachingCamera]) -> None:
        self.cameras = cameras
        self.fraction = 0.0

    def advance(self) -> None:
        self.fraction += 1.0 / 3.0

    @property
    def done(self) -> bool:
        return self.fraction > 0.9

    def stop(self, *, waits: bool = False) -> None:
        self.fraction = 1.0


def test_two_viewports_have_their_holes_filled_one_after_the_other(
    scene: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hole_filler, "call_later", lambda *_: None)
    monkeypatch.setattr(hole_job, "HoleJob", QuickJob)
    clock, folder = Clock(), folder_of(scene)
    fillers = [HoleFiller(clock), HoleFiller(clock)]
    for _ in range(2):
        for x, filler in enumerate(fillers):
            filler.follow(scene, opened(folder), view_at(float(x)), is_whole=True)
        clock.now += STILL_S + 0.01
    fillers[0]._tick()
    first = hole_job.current()
    assert first is not None
    assert fillers[1]._tick() is not None
    assert hole_job.current() is first
    assert fillers[1].status == "filling holes"
    wait_for(fillers[0])
    assert first.done
    fillers[1]._tick()
    second = cast("QuickJob", hole_job.current())
    # Each has its own view's camera.
    assert second.cameras[0].origin[0] == 1.0
    wait_for(fillers[1])
    assert [filler.status for filler in fillers] == ["", ""]


class EndlessJob:
    """In the place of a `job.Job`: it has no process, and ends when it is stopped."""

    fraction, message = 0.5, "baking"

    def __init__(self, *_: Any) -> None:
        self.done, self.error = False, ""

    def advance(self) -> None:
        pass

    def stop(self) -> None:
        self.error = self.error or "stopped"
        self.done = True


def test_what_gave_way_to_a_final_render_is_asked_for_again(
    extension: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hole_filler, "call_later", lambda *_: None)
    monkeypatch.setattr(job, "Job", EndlessJob)
    scene: Any = bpy.context.scene
    clock, shown = Clock(), opened(tmp_path)
    filler = HoleFiller(clock)

    def follow() -> str:
        filler.follow(scene, shown, view_at(0.0), is_whole=True)
        return filler.status

    def give_way() -> hole_job.HoleJob:
        """A final render starts its own, and this one's process ends a little later."""
        before, others = hole_job.current(), hole_job.start(scene, tmp_path, ())
        assert before is not None
        end = time.monotonic() + 10.0
        while not before.done:
            assert time.monotonic() < end
            time.sleep(0.01)
        return others

    follow()
    clock.now += STILL_S + 0.01
    assert follow() == "filling holes"
    filler._tick()
    assert follow() == "filling holes, 50 %"
    others = give_way()
    for _ in range(3):
        assert filler._tick() is not None
        assert follow() == "filling holes"
        assert hole_job.current() is others
    others.stop(waits=True)
    # The render baked what the cache lacked of this view.
    assert filler._tick() is None
    shown.session.coverage.open_fraction = 0.0
    assert follow() == ""
    assert filler._tick() is None
    assert hole_job.current() is None
    # And if it was of another view, the filling goes on.
    shown.session.coverage.open_fraction = 0.1
    filler.note_change(SceneChanges(geometry=True))
    clock.now += STILL_S + 0.01
    follow()
    filler._tick()
    others = give_way()
    filler._tick()
    others.stop(waits=True)
    assert filler._tick() is None
    assert follow() == "filling holes"
    filler._tick()
    assert follow() == "filling holes, 50 %"
    # One that is stopped for good is not begun again.
    hole_job.stop_current(waits=True)
    assert filler._tick() is None
    assert "stopped" in follow()


def test_sharpening_switched_on_or_off_ends_what_is_under_way(
    scene: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hole_filler, "call_later", lambda *_: None)
    monkeypatch.setattr(hole_job, "HoleJob", QuickJob)
    clock, view = Clock(), view_at(0.0)
    filler = HoleFiller(clock)
    holes = HolePoints(np.random.default_rng(1).uniform(-0.1, 0.1, (50, 3)), np.arange(50) < 25)
    soft = replace(holes, is_soft=~holes.is_hole)

    def points(*, and_soft: bool) -> HolePoints:
        return soft if and_soft else holes

    shown: Any = SimpleNamespace(
        folder=folder_of(scene),
        stale="",
        session=SimpleNamespace(coverage=SimpleNamespace(open_fraction=0.5), hole_points=points),
    )

    def start() -> Any:
        for _ in range(2):
            filler.follow(scene, shown, view, is_whole=True)
            clock.now += STILL_S + 0.01
        filler._tick()
        return hole_job.current()

    coarse = start()
    assert filler.status == "filling holes, 33 %"
    scene.relume.sharpen_views = True
    fine = start()
    assert coarse.done
    assert not fine.done
    assert filler.status == "sharpening the view, 33 %"
    scene.relume.sharpen_views = False
    last = start()
    assert fine.done
    assert not last.done
    assert [camera.to_json() for camera in last.cameras] == [
        camera.to_json() for camera in coarse.cameras
    ]
    wait_for(filler)


def test_what_is_left_of_a_view_is_said(
    extension: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hole_filler, "call_later", lambda *_: None)
    monkeypatch.setattr(hole_job, "HoleJob", QuickJob)
    monkeypatch.setattr(hole_render, "_TICK_S", 0.0)
    scene: Any = bpy.context.scene
    main: Any = SimpleNamespace(do=lambda function: function())
    shown = opened(tmp_path)
    shown.follow_filled = lambda: True
    clock = Clock()
    filler = HoleFiller(clock)
    whole = hole_cameras(view_at(0.0), shown.session.hole_points())
    for left in (0.0, 0.25):
        found = replace(whole, left=left)
        monkeypatch.setattr(hole_filler, "hole_cameras", lambda *_, found=found: found)
        monkeypatch.setattr(hole_render, "hole_cameras", lambda *_, found=found: found)
        said = hole_render.fill_for_render(scene, shown, view_at(0.0), silent, main)
        for _ in range(2):
            filler.follow(scene, shown, view_at(left), is_whole=True)
            clock.now += STILL_S + 0.01
        assert said == filler.note == found.note
        assert bool(said) == (left > 0.0)
    wait_for(filler)
    assert "25.00 % of what the cache lacks" in filler.note
    # Another view, or none that is to be filled.
    filler.follow(scene, shown, view_at(1.0), is_whole=True)
    assert filler.note == ""


def test_a_timer_that_is_there_is_not_set_again(extension: None) -> None:
    filler = HoleFiller()
    call_later(filler._timer, 100.0)
    assert bpy.app.timers.is_registered(filler._timer)
    call_later(filler._timer, 0.0)
    bpy.app.timers.unregister(filler._timer)
    assert not bpy.app.timers.is_registered(filler._timer)


def test_what_fails_is_said_once(scene: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hole_filler, "call_later", lambda *_: None)
    clock = Clock()
    filler = HoleFiller(clock)
    elsewhere = folder_of(scene).parent / "none"
    for _ in range(2):
        filler.follow(scene, opened(elsewhere), view_at(0.0), is_whole=True)
        clock.now += STILL_S + 0.01
    filler.follow(scene, opened(elsewhere), view_at(0.0), is_whole=True)
    wait_for(filler)
    assert "holds no Relume cache" in filler.status
    filler.follow(scene, opened(elsewhere), view_at(0.0), is_whole=True)
    assert filler._tick() is None
