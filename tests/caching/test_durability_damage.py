# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged caches: what is read is what was written, or one line says what is damaged."""

from __future__ import annotations

import contextlib
import json
import os
import random
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.caching.manifest_file import MANIFEST_NAME, SCHEMA_VERSION
from addon.caching.manifest_seal import sealed
from addon.caching.store import CacheStore
from addon.errors import InputError
from addon.ui.cache_stamp import cache_stamp

from .killed_writer import COUNT, MANIFEST, begun, camera, generation_of, picture

FLIPS = 2000

WORLD = np.random.default_rng(0).random((8, 16, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache of three finished cameras and a world. Not to be changed."""
    folder = tmp_path_factory.mktemp("good") / "cache"
    store = begun(folder)
    for number in range(3):
        store.add_camera(picture(number, number + 7))
    store.add_world(WORLD, "sky")
    return folder


@pytest.fixture
def cache(good: Path, tmp_path: Path) -> CacheStore:
    """A copy of it."""
    return CacheStore.open(Path(shutil.copytree(good, tmp_path / "cache")))


def one_line(error: InputError, *words: str) -> None:
    """Names the place and says what to do, in one line."""
    text = str(error)
    assert "\n" not in text
    assert len(text) < 500
    assert any(remedy in text for remedy in ("bake ", "choose another", "update Relume")), text
    for word in words:
        assert word in text


def all_is_right(folder: Path) -> None:
    """What a reader of the cache reads is what was written; raises InputError if it is told so."""
    store = CacheStore.open(folder)
    assert store.plan == MANIFEST.plan
    assert [c.to_json() for c in store.manifest.cameras] == [
        camera(n).to_json() for n in range(COUNT)
    ]
    assert set(store.manifest.finished) == {0, 1, 2}
    for number in range(3):
        assert generation_of(store, number) == number + 7
    assert (store.read_world("sky") == WORLD).all()


def pictures(store: CacheStore) -> list[Path]:
    world = store.world_path
    assert world is not None
    return [*(store.camera_path(number) for number in range(3)), world]


def test_a_truncated_file_is_named_wherever_it_ends(cache: CacheStore) -> None:
    all_is_right(cache.folder)
    cuts = random.Random(0)
    for path in pictures(cache):
        data = path.read_bytes()
        for length in (0, 1, len(data) - 1, *(cuts.randrange(len(data)) for _ in range(40))):
            path.write_bytes(data[:length])
            with pytest.raises(InputError) as caught:
                all_is_right(cache.folder)
            one_line(caught.value, path.name, "damaged")
        path.write_bytes(data + b"\0")
        with pytest.raises(InputError, match="damaged"):
            all_is_right(cache.folder)
        path.write_bytes(data)
    all_is_right(cache.folder)


def test_a_flipped_bit_of_a_picture_is_found_wherever_it_is(cache: CacheStore) -> None:
    bits = random.Random(1)
    for path in pictures(cache):
        data = bytearray(path.read_bytes())
        for _ in range(100):
            place, bit = bits.randrange(len(data)), 1 << bits.randrange(8)
            data[place] ^= bit
            path.write_bytes(data)
            with pytest.raises(InputError) as caught:
                all_is_right(cache.folder)
            one_line(caught.value, path.name, "damaged")
            data[place] ^= bit
        path.write_bytes(data)


def test_a_manifest_is_read_as_it_was_written_or_not_at_all(cache: CacheStore) -> None:
    """Bits of names, of numbers, of marks. What only changes white space, or writes the same
    number in another way, leaves it as it was."""
    bits = random.Random(2)
    path = cache.folder / MANIFEST_NAME
    text = path.read_bytes()
    content = cache.manifest.to_json()
    harmless = 0
    for _ in range(FLIPS):
        data = bytearray(text)
        data[bits.randrange(len(text))] ^= 1 << bits.randrange(8)
        path.write_bytes(data)
        try:
            found = CacheStore.open(cache.folder).manifest.to_json()
        except InputError as error:
            one_line(error, str(cache.folder))
        else:
            assert found == content
            harmless += 1
    assert harmless < 0.01 * FLIPS
    for length in (0, len(text) - 2, *(bits.randrange(len(text) - 1) for _ in range(100))):
        path.write_bytes(text[:length])
        with pytest.raises(InputError, match=r"manifest\.json is damaged"):
            CacheStore.open(cache.folder)


def test_a_number_that_was_changed_by_hand(cache: CacheStore) -> None:
    path = cache.folder / MANIFEST_NAME
    data = json.loads(path.read_text())
    data["cameras"][1]["fov"] = 1.5
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match=r"manifest\.json is damaged: it was changed") as caught:
        CacheStore.open(cache.folder)
    one_line(caught.value)
    # The seal is against accidents: who seals it again says that it is meant.
    path.write_text(json.dumps(sealed(data)))
    assert CacheStore.open(cache.folder).manifest.cameras[1].fov == 1.5


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is damaged"),
        (b"\0" * 4096, "is damaged"),
        (b"\xff\xfe{", "is damaged"),
        (b"null", "not a Relume cache's manifest"),
        (b"[" * 100_000, "is damaged"),
        (b'{"schema": "relume-cache", "version": true}', "version"),
        (b'{"schema": "relume-cache", "version": "2"}', "version"),
        (b'{"schema": "relume-cache", "version": 1}', "is of an older version"),
        (b'{"schema": "relume-cache", "version": 99}', "is of a newer version.*update Relume"),
        (f'{{"schema": "relume-cache", "version": {SCHEMA_VERSION}}}'.encode(), "older than this"),
    ],
)
def test_manifests_that_are_none(cache: CacheStore, content: bytes, words: str) -> None:
    path = cache.folder / MANIFEST_NAME
    path.write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        CacheStore.open(cache.folder)
    one_line(caught.value)
    # Nor is it baked over unasked.
    with pytest.raises(InputError, match="--overwrite replaces it") as caught:
        begun(cache.folder)
    one_line(caught.value)
    assert path.read_bytes() == content
    assert len(begun(cache.folder, overwrite=True).manifest.cameras) == COUNT


@pytest.mark.parametrize(
    "change",
    [
        {"finished": {"0": {"size": 1e400, "sha256": ""}}},
        {"finished": {"zero": {}}},
        {"cameras": None},
        {"cameras": [[]]},
        {"plan": []},
        {"settings": 3},
        {"world": "sky"},
    ],
)
def test_sealed_nonsense(cache: CacheStore, change: dict[str, object]) -> None:
    """What no damage makes, but a program may: Relume before, or after."""
    path = cache.folder / MANIFEST_NAME
    path.write_text(json.dumps(sealed(json.loads(path.read_text()) | change)))
    with pytest.raises(InputError, match="another version of Relume") as caught:
        CacheStore.open(cache.folder)
    one_line(caught.value, str(path), "bake the cache again")


def test_a_cache_of_before_a_change_of_form(cache: CacheStore) -> None:
    """It lacks what the manifest has since: nothing is damaged."""
    path = cache.folder / MANIFEST_NAME
    data = json.loads(path.read_text())
    del data["surfaces"]
    path.write_text(json.dumps(sealed(data)))
    with pytest.raises(InputError, match="another version of Relume") as caught:
        CacheStore.open(cache.folder)
    one_line(caught.value, str(path), "bake the cache again")
    assert "damaged" not in str(caught.value)


def test_folders_in_the_place_of_files(cache: CacheStore) -> None:
    path = cache.camera_path(1)
    path.unlink()
    path.mkdir()
    with pytest.raises(InputError, match=r"cannot be read: Is a directory") as caught:
        cache.read_camera(1)
    one_line(caught.value, path.name)
    assert not cache.is_intact(1)
    manifest = cache.folder / MANIFEST_NAME
    manifest.unlink()
    manifest.mkdir()
    attempts: list[Callable[[], object]] = [
        lambda: CacheStore.open(cache.folder),
        lambda: begun(cache.folder),
        lambda: begun(cache.folder, overwrite=True),
    ]
    for attempt in attempts:
        with pytest.raises(InputError) as caught:
            attempt()
        one_line(caught.value, MANIFEST_NAME)
    # A folder that others filled is not removed.
    assert manifest.is_dir()


def test_a_file_in_the_place_of_the_cameras_folder(cache: CacheStore) -> None:
    shutil.rmtree(cache.folder / "cameras")
    (cache.folder / "cameras").write_text("mine")
    with pytest.raises(InputError, match="is missing"):
        cache.read_camera(0)
    store = begun(cache.folder, resume=True)
    with pytest.raises(InputError, match="cannot be written: ") as caught:
        store.add_camera(picture(0, 1))
    one_line(caught.value, str(cache.folder))
    assert (cache.folder / "cameras").read_text() == "mine"


def test_another_cameras_picture(cache: CacheStore) -> None:
    """Under either name it is not what the manifest knows."""
    mine, other = cache.camera_path(0), cache.camera_path(1)
    shutil.copyfile(other, mine)
    with pytest.raises(InputError, match="not the file that was baked") as caught:
        cache.read_camera(0)
    one_line(caught.value, mine.name)
    assert not cache.is_intact(0)
    assert generation_of(cache, 1) == 8


def test_damaged_pictures_are_baked_again_and_others_kept(cache: CacheStore) -> None:
    for path in (cache.camera_path(1), cache.world_path):
        assert path is not None
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 4
        path.write_bytes(data)
    store = begun(cache.folder, resume=True)
    assert [store.is_intact(number) for number in range(3)] == [True, False, True]
    assert not store.has_world("sky")
    store.add_camera(picture(1, 8))
    store.add_world(WORLD, "sky")
    all_is_right(cache.folder)


def test_a_removed_folder_of_cameras_is_made_again(cache: CacheStore) -> None:
    shutil.rmtree(cache.folder / "cameras")
    store = begun(cache.folder, resume=True)
    for number in range(3):
        assert not store.is_intact(number)
        store.add_camera(picture(number, number + 7))
    all_is_right(cache.folder)


def test_a_cache_that_is_removed_while_it_is_baked(cache: CacheStore) -> None:
    shutil.rmtree(cache.folder)
    attempts: list[Callable[[], object]] = [
        lambda: cache.add_camera(picture(3, 1)),
        lambda: cache.add_world(WORLD, "sky"),
    ]
    for attempt in attempts:
        with pytest.raises(InputError, match="cannot be written: No such file") as caught:
            attempt()
        one_line(caught.value, str(cache.folder))
    # Nothing of it is made again, which would look like a cache.
    assert not cache.folder.exists()


def test_a_cache_whose_manifest_is_removed_while_it_is_baked(cache: CacheStore) -> None:
    (cache.folder / MANIFEST_NAME).unlink()
    with pytest.raises(InputError, match="holds no Relume cache") as caught:
        cache.add_camera(picture(3, 1))
    one_line(caught.value, str(cache.folder))
    assert not list(cache.folder.rglob("0003*"))
    assert not list(cache.folder.rglob(".*.part"))


def test_clocks_that_go_backwards(cache: CacheStore) -> None:
    """No file's time decides which is right; a viewport sees each change all the same."""
    manifest = cache.folder / MANIFEST_NAME
    future = 4_000_000_000.0
    for path in cache.folder.rglob("*"):
        os.utime(path, (future, future))
    stamp = cache_stamp(cache.folder)
    young = cache.folder / "cameras" / ".0005.exr.1.part"
    young.write_bytes(b"another process is writing it")
    os.utime(young, (future, future))
    store = begun(cache.folder, resume=True)
    assert all(store.is_intact(number) for number in range(3))
    store.add_camera(picture(1, 50))
    os.utime(manifest, (future, future))
    assert cache_stamp(cache.folder) != stamp
    assert generation_of(CacheStore.open(cache.folder), 1) == 50
    assert young.exists()
    # Time long gone, as an unpacked archive may have.
    for path in cache.folder.rglob("*.exr"):
        os.utime(path, (0.0, 0.0))
    store = begun(cache.folder, resume=True)
    assert [generation_of(store, number) for number in range(3)] == [7, 50, 9]


@pytest.mark.parametrize("missing", ["folder", "manifest"])
def test_what_is_no_cache(tmp_path: Path, missing: str) -> None:
    folder = tmp_path / "cache"
    if missing == "manifest":
        folder.mkdir()
    with pytest.raises(InputError, match="holds no Relume cache") as caught:
        CacheStore.open(folder)
    one_line(caught.value, str(folder))


def test_a_folder_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "cache").write_text("mine")
    with pytest.raises(InputError, match="holds no Relume cache"):
        CacheStore.open(tmp_path / "cache")
    with pytest.raises(InputError, match="cannot be written") as caught:
        begun(tmp_path / "cache")
    one_line(caught.value, "cache")
    assert (tmp_path / "cache").read_text() == "mine"


def test_other_files_in_the_folder_stay(cache: CacheStore) -> None:
    mine = [cache.folder / "notes.txt", cache.folder / "cameras" / "render.png"]
    for path in mine:
        path.write_text("mine")
    edited = replace(camera(1), far=99.0)
    begun(cache.folder, replace(MANIFEST, cameras=(camera(0), edited)), overwrite=True)
    with contextlib.suppress(InputError):
        begun(cache.folder, overwrite=True)
    assert [path.read_text() for path in mine] == ["mine", "mine"]
