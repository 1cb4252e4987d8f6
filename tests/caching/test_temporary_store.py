# SPDX-License-Identifier: GPL-3.0-or-later
"""Temporary pictures beside a cache: added, read, kept, discarded, by one process or several."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from addon.caching import temporary_store
from addon.caching.frame_state import FrameState
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.manifest import Manifest
from addon.caching.plan import ChannelPlan
from addon.caching.store import CacheStore
from addon.caching.temporary_store import TemporaryStore, discard_all
from addon.camplace.camera import CachingCamera
from addon.errors import InputError
from addon.progress import silent
from tests import synthetic

PLAN = ChannelPlan(("depth", "material_id", "normal", "diffuse_color"), {}, ("one",))
CAMERAS = tuple(synthetic.cube_cameras((0.0, 0.0, 0.0), 16))
FINGERPRINT = "0123456789abcdef" * 4


def picture(camera: int, tone: float = 0.5) -> DeepFramebuffer:
    side = CAMERAS[camera].resolution
    channels = {
        "depth": np.full((side, side, 1), 2.0, np.float32),
        "material_id": np.ones((side, side, 1), np.float32),
        "normal": np.tile(np.array([0.0, 0.0, 1.0], np.float32), (side, side, 1)),
        "diffuse_color": np.full((side, side, 3), tone, np.float32),
    }
    return DeepFramebuffer(CAMERAS[camera], channels)


@pytest.fixture
def cache(tmp_path: Path) -> CacheStore:
    store = CacheStore.create(
        tmp_path / "scene.relume", Manifest(FINGERPRINT, {"preset": "draft"}, PLAN, CAMERAS[:2])
    )
    store.add_camera(picture(0))
    store.add_camera(picture(1))
    return CacheStore.open(store.folder)


def tones(temporary: TemporaryStore) -> list[float]:
    found = temporary.read()
    return [round(float(f.channels["diffuse_color"][0, 0, 0]), 3) for f in found]


def test_what_is_added_is_read_and_the_cache_does_not_know(cache: CacheStore) -> None:
    manifest = (cache.folder / "manifest.json").read_bytes()
    temporary = TemporaryStore(cache)
    assert not temporary.read()
    assert not temporary.cameras
    numbers = [temporary.add(picture(4, tone)) for tone in (0.25, 0.75)]
    assert tones(TemporaryStore(cache)) == [0.25, 0.75]
    assert [camera.id for camera in temporary.cameras] == numbers
    assert np.array_equal(
        temporary.cameras[0].world_from_camera, picture(4).camera.world_from_camera
    )
    assert (cache.folder / "manifest.json").read_bytes() == manifest
    assert temporary.bytes > 0
    temporary.discard(numbers[:1])
    assert tones(temporary) == [0.75]
    temporary.discard()
    assert not (cache.folder / "temporary").exists()


def test_kept_pictures_are_the_caches_own(cache: CacheStore) -> None:
    temporary = TemporaryStore(cache)
    for tone in (0.25, 0.75):
        temporary.add(picture(4, tone))
    kept = temporary.keep()
    assert [camera.id for camera in kept] == [2, 3]
    now = CacheStore.open(cache.folder)
    assert [camera.id for camera in now.cameras] == [0, 1, 2, 3]
    assert now.read_camera(3).channels["diffuse_color"][0, 0, 0] == pytest.approx(0.75)
    assert all(now.is_intact(number) for number in range(4))
    assert not (cache.folder / "temporary").exists()
    # A bake that was under way goes on: what it finishes is beside them.
    cache.add_camera(picture(1, 0.125))
    assert [camera.id for camera in CacheStore.open(cache.folder).cameras] == [0, 1, 2, 3]


def test_kept_cameras_leave_numbers_that_are_taken(cache: CacheStore) -> None:
    """Of cameras that were placed and are not baked yet."""
    temporary = TemporaryStore(cache)
    for tone in (0.25, 0.75):
        temporary.add(picture(4, tone))
    assert [camera.id for camera in temporary.keep(taken=(0, 1, 2, 5))] == [6, 7]
    assert [camera.id for camera in CacheStore.open(cache.folder).cameras] == [0, 1, 6, 7]


def test_a_frames_pictures_are_kept_with_the_frame(cache: CacheStore) -> None:
    other = FINGERPRINT[::-1]
    cache.set_frame(7, FrameState(other, None, {0: cache.manifest.first_name(0)}))
    cache = CacheStore.open(cache.folder)
    at_frame = cache.showing(other, 7)
    temporary = TemporaryStore(at_frame)
    temporary.add(picture(4, 0.25))
    assert TemporaryStore(cache).read() == ()
    temporary.keep()
    now = CacheStore.open(cache.folder)
    assert [camera.id for camera in now.cameras] == [0, 1]
    shown = now.showing(other, 7)
    assert [camera.id for camera in shown.cameras] == [0, 2]
    assert shown.read_camera(2).channels["diffuse_color"][0, 0, 0] == pytest.approx(0.25)


def test_pictures_of_a_state_that_is_gone_go(cache: CacheStore) -> None:
    temporary = TemporaryStore(cache)
    temporary.add(picture(4))
    changed = replace(cache.manifest, fingerprint="f" * 64, finished={})
    store = CacheStore.create(cache.folder, changed)
    assert TemporaryStore(store).read() == ()
    with pytest.raises(InputError, match="no longer as it was"):
        temporary.keep()
    TemporaryStore(store).add(picture(5, 0.75))
    assert not temporary.folder.exists()
    assert tones(TemporaryStore(store)) == [0.75]


def test_pictures_of_other_channels_are_not_read(cache: CacheStore) -> None:
    TemporaryStore(cache).add(picture(4))
    other = replace(PLAN, constants={"roughness": (0.25,)})
    store = CacheStore.create(cache.folder, replace(cache.manifest, plan=other, finished={}))
    assert TemporaryStore(store).read() == ()
    TemporaryStore(store).add(picture(4, 0.75))
    assert tones(TemporaryStore(store)) == [0.75]


@pytest.mark.parametrize("budget", ["MOST_PICTURES", "MOST_BYTES"])
def test_the_oldest_give_way(
    cache: CacheStore, budget: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    temporary = TemporaryStore(cache)
    temporary.add(picture(2, 0.25))
    most = 3 if budget == "MOST_PICTURES" else int(3.5 * temporary.bytes)
    monkeypatch.setattr(temporary_store, budget, most)
    for tone in (0.5, 0.75, 1.0):
        temporary.add(picture(2, tone))
    assert tones(temporary) == [0.5, 0.75, 1.0]
    files = list(temporary.folder.rglob("*.exr"))
    assert len(files) == 3


def test_pictures_that_belong_together_do_not_give_way_to_one_another(
    cache: CacheStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    temporary = TemporaryStore(cache)
    monkeypatch.setattr(temporary_store, "MOST_PICTURES", 3)
    for tone in (0.125, 0.25):
        temporary.add(picture(2, tone))
    numbers: list[int] = []
    for tone in (0.5, 0.625, 0.75, 0.875):
        numbers.append(temporary.add(picture(2, tone), numbers))
        assert tones(temporary)[-len(numbers) :] == [0.5, 0.625, 0.75, 0.875][: len(numbers)]
    assert [camera.id for camera in temporary.cameras] == numbers
    # The next ones are baked for something else.
    temporary.add(picture(2, 1.0))
    assert tones(temporary) == [0.75, 0.875, 1.0]


@pytest.mark.parametrize("budget", ["MOST_PICTURES", "MOST_BYTES"])
def test_what_is_baked_for_a_view_is_there_at_the_end(
    cache: CacheStore, budget: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from addon import hole_bake

    class Bake:
        def __init__(self, *_: Any, **__: Any) -> None:
            pass

        def run(self, cameras: Sequence[CachingCamera], keep: Any, *_: Any) -> None:
            for camera in cameras:
                keep(picture(camera.id), None)

    state = SimpleNamespace(
        fingerprint=FINGERPRINT,
        frame=cache.manifest.frame,
        geometry=SimpleNamespace(material_names=()),
    )
    monkeypatch.setattr(hole_bake, "read_state", lambda *_: state)
    monkeypatch.setattr(hole_bake, "specialized", lambda *_: nullcontext((PLAN, ())))
    monkeypatch.setattr(hole_bake, "CamerasBake", Bake)
    monkeypatch.setattr(temporary_store, budget, 3)
    scene: Any = SimpleNamespace(frame_current=1)
    geometry: Any = None
    temporary = TemporaryStore(cache)
    temporary.add(picture(2))
    first = hole_bake.bake_holes(scene, geometry, cache, CAMERAS[:5], silent)
    assert [camera.id for camera in temporary.cameras] == list(first)
    second = hole_bake.bake_holes(scene, geometry, cache, CAMERAS[:2], silent, together=first)
    assert [camera.id for camera in temporary.cameras] == [*first, *second]


def test_a_damaged_picture_is_left_out(cache: CacheStore) -> None:
    temporary = TemporaryStore(cache)
    temporary.add(picture(2, 0.25))
    temporary.add(picture(2, 0.75))
    first = min(temporary.folder.rglob("0000-*.exr"))
    first.write_bytes(first.read_bytes()[:-10])
    assert tones(temporary) == [0.75]
    (temporary.folder / "manifest.json").write_text("{", encoding="utf-8")
    assert temporary.read() == ()
    # And takes nothing from those that come.
    temporary.add(picture(2, 0.5))
    assert tones(temporary) == [0.5]


def test_several_at_once_lose_nothing(cache: CacheStore) -> None:
    stores = [TemporaryStore(CacheStore.open(cache.folder)) for _ in range(4)]
    failures: list[Exception] = []

    def work(index: int) -> None:
        try:
            numbers = [stores[index].add(picture(2, 0.125 * index)) for _ in range(3)]
            stores[index].discard(numbers[:1])
        except Exception as error:  # noqa: BLE001 - a thread's own would be lost
            failures.append(error)

    threads = [threading.Thread(target=work, args=(index,)) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
    assert sorted(tones(stores[0])) == sorted(0.125 * index for index in range(4) for _ in range(2))


def test_all_can_be_discarded(cache: CacheStore) -> None:
    TemporaryStore(cache).add(picture(2))
    discard_all(cache.folder)
    assert TemporaryStore(cache).read() == ()
    discard_all(cache.folder)


def test_what_cannot_be_written_is_told_before_anything_is_baked(
    cache: CacheStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    from addon import hole_bake

    (cache.folder / temporary_store.FOLDER_NAME).touch()
    state = SimpleNamespace(fingerprint=FINGERPRINT, frame=cache.manifest.frame)
    monkeypatch.setattr(hole_bake, "read_state", lambda *_: state)
    monkeypatch.setattr(hole_bake, "CamerasBake", None)
    scene: Any = SimpleNamespace(frame_current=1)
    geometry: Any = None
    with pytest.raises(InputError, match="cannot be written"):
        hole_bake.bake_holes(scene, geometry, cache, CAMERAS[:1], silent)
