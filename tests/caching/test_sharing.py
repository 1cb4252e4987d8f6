# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes that share a cache, go on with it, or take its place."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from addon.caching.bake_settings import BakeSettings, prepare_store, preset_to_bake
from addon.caching.carry import Carrier
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.manifest import Manifest
from addon.caching.plan import ChannelPlan
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera
from addon.errors import InputError

COUNT = 24
PLAN = ChannelPlan(("depth", "normal"), {"material_id": (1.0,)}, ("grey",))


def camera(number: int) -> CachingCamera:
    return CachingCamera(number, np.eye(4), 1.0, 0.1, 10.0, 2, "CUBE_FACE", 0)


def framebuffer(number: int) -> DeepFramebuffer:
    shapes = {"depth": (2, 2, 1), "normal": (2, 2, 3)}
    channels = {name: np.full(shape, number, dtype=np.float32) for name, shape in shapes.items()}
    return DeepFramebuffer(camera(number), channels)


MANIFEST = Manifest("scene", {"preset": "draft"}, PLAN, tuple(camera(i) for i in range(COUNT)))


def bake_some(folder: Path, numbers: range) -> None:
    """What one process of a farm does."""
    store = prepare_store(folder, MANIFEST, BakeSettings(only=frozenset(numbers)))
    for number in numbers:
        store.add_camera(framebuffer(number))


def test_processes_do_not_lose_each_others_cameras(tmp_path: Path) -> None:
    """Three processes begin one cache and add to it as fast as they can."""
    script = (
        "from pathlib import Path; from tests.caching.test_sharing import bake_some; "
        f"import sys; n = int(sys.argv[1]); bake_some(Path({str(tmp_path / 'cache')!r}), "
        f"range(n, {COUNT}, 3))"
    )
    children = [
        subprocess.Popen([sys.executable, "-c", script, str(n)], cwd=Path.cwd()) for n in range(3)
    ]
    assert [child.wait() for child in children] == [0, 0, 0]
    store = CacheStore.open(tmp_path / "cache")
    assert [c.id for c in store.cameras] == list(range(COUNT))
    for number in range(COUNT):
        assert (store.read_camera(number).channels["depth"] == number).all()


@pytest.fixture
def begun(tmp_path: Path) -> CacheStore:
    """A cache whose first four cameras are finished."""
    store = CacheStore.create(tmp_path / "cache", MANIFEST)
    for number in range(4):
        store.add_camera(framebuffer(number))
    return store


def finished(folder: Path) -> set[int]:
    return set(CacheStore.open(folder).manifest.finished)


def test_resuming_keeps_what_is_finished(begun: CacheStore) -> None:
    store = prepare_store(begun.folder, MANIFEST, BakeSettings(resume=True))
    assert set(store.manifest.finished) == {0, 1, 2, 3}


def test_a_part_is_baked_again_within_the_rest(begun: CacheStore) -> None:
    prepare_store(begun.folder, MANIFEST, BakeSettings(only=frozenset({2, 9})))
    # What is there stays until its new file takes its place.
    assert finished(begun.folder) == {0, 1, 2, 3}


def test_the_same_bake_again_loses_nothing_when_it_fails(begun: CacheStore) -> None:
    prepare_store(begun.folder, MANIFEST, BakeSettings())
    assert finished(begun.folder) == {0, 1, 2, 3}


def test_a_whole_bake_begins_anew(begun: CacheStore) -> None:
    fewer = replace(MANIFEST, cameras=MANIFEST.cameras[:2])
    prepare_store(begun.folder, fewer, BakeSettings())
    assert finished(begun.folder) == set()
    # Nothing of the earlier cache is left for good.
    assert list((begun.folder / "cameras").iterdir()) == []


RESUMED, PART = BakeSettings(resume=True), BakeSettings(only=frozenset({1}))
OTHER_CHANNELS = replace(MANIFEST, plan=replace(PLAN, constants={}))


@pytest.mark.parametrize(
    ("changed", "message", "part"),
    [
        *(
            (changed, message, part)
            for changed, message in [
                (replace(MANIFEST, settings={"preset": "final"}), "baked with the preset 'draft'"),
                (replace(MANIFEST, cameras=MANIFEST.cameras[1:]), "other caching cameras"),
                (replace(MANIFEST, fingerprint="changed scene"), "another scene"),
            ]
            for part in (RESUMED, PART)
        ),
        (OTHER_CHANNELS, "other channels", PART),
    ],
)
def test_unlike_bakes_are_not_mixed(
    begun: CacheStore, part: BakeSettings, changed: Manifest, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        prepare_store(begun.folder, changed, part)
    assert finished(begun.folder) == {0, 1, 2, 3}
    prepare_store(begun.folder, changed, replace(part, overwrite=True))
    # Pictures of the same cameras of the same scene are as good as new.
    same = part.resume and changed.cameras != MANIFEST.cameras
    assert finished(begun.folder) == ({1, 2, 3} if same else set())


def test_other_channels_are_baked_again(begun: CacheStore) -> None:
    carrier = Carrier()
    prepare_store(begun.folder, OTHER_CHANNELS, RESUMED, carrier)
    assert finished(begun.folder) == set()
    (note,) = carrier.notes
    assert "need other channels" in note


def test_cameras_that_were_not_edited_are_kept(begun: CacheStore) -> None:
    moved = np.eye(4)
    moved[0, 3] = 1.0
    cameras = list(MANIFEST.cameras)
    cameras[1] = replace(cameras[1], world_from_camera=moved)
    cameras[2] = replace(cameras[2], far=20.0)
    edited = replace(MANIFEST, cameras=(*cameras, camera(COUNT)))
    store = prepare_store(begun.folder, edited, BakeSettings(resume=True, overwrite=True))
    assert finished(begun.folder) == {0, 3}
    assert store.is_intact(3)
    assert not store.is_intact(1)
    assert (CacheStore.open(begun.folder).read_camera(3).channels["depth"] == 3).all()


def test_a_bake_that_lost_its_place_stops(begun: CacheStore) -> None:
    prepare_store(
        begun.folder, replace(MANIFEST, fingerprint="other"), BakeSettings(overwrite=True)
    )
    with pytest.raises(InputError, match="took the place"):
        begun.add_camera(framebuffer(5))
    assert finished(begun.folder) == set()


def test_damaged_manifests_are_replaced_on_request(begun: CacheStore) -> None:
    (begun.folder / "manifest.json").write_text("{")
    with pytest.raises(InputError, match="damaged"):
        prepare_store(begun.folder, MANIFEST, BakeSettings())
    store = prepare_store(begun.folder, MANIFEST, BakeSettings(overwrite=True))
    assert len(store.manifest.cameras) == COUNT


def test_a_new_bake_sweeps_what_a_killed_one_was_writing(begun: CacheStore) -> None:
    old, young = (begun.folder / "cameras" / f".0009.exr.{pid}.part" for pid in (11, 12))
    old.write_bytes(b"half")
    young.write_bytes(b"half")
    yesterday = time.time() - 86400.0
    os.utime(old, (yesterday, yesterday))
    prepare_store(begun.folder, MANIFEST, BakeSettings())
    # The young one may be another process's.
    assert not old.exists()
    assert young.exists()


def test_only_a_caches_own_pictures_are_swept(tmp_path: Path) -> None:
    """In a folder that holds an artist's pictures too."""
    names = ["world.exr", "world_sunset.exr", "cameras/lens.exr", "cameras/0001.exr"]
    names += ["frames/sh010/0001-0a1b2c3d.exr", "frames/0012/0001.exr", ".half.part"]
    own = ["world-0a1b2c3d.exr", "cameras/0099-0a1b2c3d.exr", "frames/-012/0007-0a1b2c3d.exr"]
    long_ago = time.time() - 86400.0
    for name in (*names, *own):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        os.utime(path, (long_ago, long_ago))
    prepare_store(tmp_path, MANIFEST, BakeSettings())
    assert [name for name in names if not (tmp_path / name).exists()] == []
    assert [name for name in own if (tmp_path / name).exists()] == []


def test_the_world_is_checked_apart(begun: CacheStore) -> None:
    begun.add_world(np.zeros((2, 4, 3), dtype=np.float32), "sky")
    again = CacheStore.open(begun.folder)
    assert again.read_world("sky").shape == (2, 4, 3)
    with pytest.raises(InputError, match="world changed"):
        again.read_world("clouds")
    # Surfaces do not depend on it.
    again.check_fingerprint("scene")


def test_what_goes_on_is_as_fine_as_it_was_begun(tmp_path: Path) -> None:
    folder = tmp_path / "cache"
    go_on = partial(preset_to_bake, folder, overwrite=False)
    assert go_on(None, goes_on=True) == "balanced"
    CacheStore.create(folder, replace(MANIFEST, settings={"preset": "final"}))
    assert go_on(None, goes_on=True) == "final"
    assert go_on(None, goes_on=False) == "balanced"
    assert go_on("draft", goes_on=True) == "draft"
    (folder / "manifest.json").write_text("{")
    with pytest.raises(InputError, match="damaged"):
        go_on(None, goes_on=True)
    assert preset_to_bake(folder, None, goes_on=True, overwrite=True) == "balanced"
