# SPDX-License-Identifier: GPL-3.0-or-later
"""Disks that fill up, folders that cannot be written or read, and writers that share one."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.caching.folder_lock import LOCK_NAME, locked
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.manifest_file import MANIFEST_NAME
from addon.caching.store import CacheStore
from addon.errors import InputError

from .killed_writer import COUNT, MANIFEST, begun, generation_of, picture
from .small_disk import on_a_small_disk


def test_a_small_disk_that_fills_up(tmp_path: Path) -> None:
    run = on_a_small_disk(
        tmp_path, 512 * 1024, [sys.executable, "-m", "tests.caching.full_disk_writer", tmp_path]
    )
    assert run.returncode == 0, run.stderr
    assert "3 written" in run.stdout


@contextmanager
def longest_file(size: int) -> Iterator[None]:
    """No file can grow beyond so many bytes, to the byte: what a quota does."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    earlier = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, earlier)


def test_writes_that_end_at_any_byte(tmp_path: Path) -> None:
    """Also the last ones of a file, which a library may write when it closes it."""
    store = begun(tmp_path / "cache")
    store.add_camera(picture(0, 1))
    store.add_camera(picture(1, 1))
    whole = begun(tmp_path / "trial").add_camera(picture(0, 2)).size
    sizes = {whole - back for back in range(1, 40)} | set(range(1, whole, whole // 60))
    for size in sorted(sizes):
        with longest_file(size), pytest.raises(InputError) as caught:
            store.add_camera(picture(0, 2))
        assert str(caught.value).startswith(str(store.folder))
        assert str(caught.value).endswith(
            " cannot be written: File too large; choose another folder"
        )
        again = CacheStore.open(store.folder)
        assert [generation_of(again, number) for number in (0, 1)] == [1, 1]
        assert not list(tmp_path.rglob(".*.part"))
    # Pictures that fit while the manifest does not.
    small = (store.folder / MANIFEST_NAME).stat().st_size - 1
    assert small < whole
    with longest_file(small), pytest.raises(InputError, match=r"manifest\.json cannot be written"):
        store.write_manifest(store.manifest)
    store.add_camera(picture(0, 2))
    assert generation_of(CacheStore.open(store.folder), 0) == 2


@pytest.mark.parametrize("side", [1, 4, 64])
def test_pictures_so_small_that_nothing_is_written_before_they_are_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, side: int
) -> None:
    """OpenEXR does not say that it failed then."""
    camera = replace(MANIFEST.cameras[0], resolution=side)
    channels = {
        "depth": np.ones((side, side, 1), np.float32),
        "normal": np.ones((side, side, 3), np.float32),
    }
    store = begun(tmp_path, replace(MANIFEST, cameras=(camera,)))
    monkeypatch.setattr("secrets.token_hex", lambda count: "token")
    part = tmp_path / "cameras" / f".0000.exr.token.{os.getpid()}.part"
    part.symlink_to("/dev/full")
    with pytest.raises(InputError, match="cannot be written: the disk is full"):
        store.add_camera(DeepFramebuffer(camera, channels))
    assert not CacheStore.open(tmp_path).cameras
    assert list((tmp_path / "cameras").iterdir()) == []


AS_NOBODY = """
import os, sys
from pathlib import Path
from tempfile import TemporaryDirectory
from tests.caching.killed_writer import begun, first_bake, picture
from addon.caching.store import CacheStore
from addon.errors import InputError
with TemporaryDirectory() as folder:  # another user may not load what loads at its first use
    first_bake(Path(folder), 0)
if os.getuid() == 0:
    os.setgid(65534); os.setuid(65534)
folder = Path(sys.argv[1])
attempts = {
    "open": lambda: CacheStore.open(folder).read_finished(),
    "go on": lambda: begun(folder, resume=True),
    "anew": lambda: begun(folder / "new"),
    "add": lambda: CacheStore.open(folder).add_camera(picture(0, 2)),
}
try:
    attempts[sys.argv[2]]()
except InputError as error:
    print(f"refused: {error}")
else:
    print("done")
"""


@pytest.fixture
def others_cache() -> Iterator[Path]:
    """A cache that another user may only read."""
    # Not below pytest's own folder, which only its user may enter.
    with tempfile.TemporaryDirectory() as place:
        Path(place).chmod(0o755)
        folder = Path(place, "cache")
        begun(folder).add_camera(picture(0, 1))
        for path in (folder, *folder.rglob("*")):
            path.chmod(0o555 if path.is_dir() else 0o444)
        yield folder
        for path in (folder, *folder.rglob("*")):
            path.chmod(0o777)


def attempt_as_nobody(folder: Path, what: str) -> str:
    run = subprocess.run(
        [sys.executable, "-c", AS_NOBODY, str(folder), what],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


def test_a_folder_that_may_only_be_read(others_cache: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in others_cache.rglob("*")}
    assert attempt_as_nobody(others_cache, "open") == "done"
    for what in ("go on", "anew", "add"):
        told = attempt_as_nobody(others_cache, what)
        assert told.startswith(f"refused: {others_cache}")
        assert told.endswith("cannot be written: Permission denied; choose another folder")
    assert {path: path.stat().st_mtime_ns for path in others_cache.rglob("*")} == before


@pytest.mark.parametrize("which", ["picture", "manifest"])
def test_files_that_may_not_be_read(others_cache: Path, which: str) -> None:
    path = others_cache / MANIFEST_NAME
    if which == "picture":
        path = CacheStore.open(others_cache).camera_path(0)
    path.chmod(0)
    told = attempt_as_nobody(others_cache, "open")
    assert told == f"refused: {path} cannot be read: Permission denied; bake the cache again"


WRITER = """
import sys
from pathlib import Path
from tests.caching.killed_writer import begun, picture
folder, writer, numbers = Path(sys.argv[1]), int(sys.argv[2]), eval(sys.argv[3])
store = begun(folder)
for turn in range(4):
    for number in numbers:
        store.add_camera(picture(number, 100 * writer + turn))
"""


@pytest.mark.parametrize("shared", [False, True])
def test_two_writers_at_once(tmp_path: Path, shared: bool) -> None:
    """Of different cameras, and of the same ones: the last that a writer finished is there."""
    parts = ("range(6)", "range(6)") if shared else ("range(0, 6, 2)", "range(1, 6, 2)")
    children = [
        subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path / "c"), str(n), part])
        for n, part in enumerate(parts, start=1)
    ]
    finished: set[int] = set()
    while any(child.poll() is None for child in children):
        # A reader that comes by at any moment finds a whole state, and no less than before.
        if (tmp_path / "c" / MANIFEST_NAME).exists():
            now = set(CacheStore.open(tmp_path / "c").manifest.finished)
            assert finished <= now
            finished = now
    assert [child.returncode for child in children] == [0, 0]
    store = CacheStore.open(tmp_path / "c")
    for number in range(COUNT):
        last = generation_of(store, number)
        assert last in ({103, 203} if shared else {103 if number % 2 == 0 else 203})
    assert len(list((tmp_path / "c" / "cameras").iterdir())) == COUNT
    assert not list(tmp_path.rglob(".*.part"))


def test_a_bake_that_lost_its_place_spoils_nothing(tmp_path: Path) -> None:
    """Another scene's bake began in the folder: its pictures of the same numbers stay."""
    lost = begun(tmp_path)
    winner = begun(tmp_path, replace(MANIFEST, fingerprint="another"), overwrite=True)
    winner.add_camera(picture(0, 9))
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(InputError, match="took the place of this one"):
        lost.add_camera(picture(0, 1))
    assert generation_of(CacheStore.open(tmp_path), 0) == 9
    assert sorted(tmp_path.rglob("*")) == before


def test_the_lock_of_a_folder_that_is_made_again(tmp_path: Path) -> None:
    """Who waited for it does not take the lock on the file that is gone for the folder's own."""
    order = []

    def wait() -> None:
        with locked(tmp_path):
            order.append("second" if (tmp_path / "mark").exists() else "first")

    waiting = threading.Thread(target=wait)
    with locked(tmp_path):
        waiting.start()
        time.sleep(0.3)  # it waits for the file that goes now
        (tmp_path / LOCK_NAME).unlink()
        again = locked(tmp_path)
        again.__enter__()
    try:
        # Its file is free now, and is not the one that is locked.
        waiting.join(0.3)
        assert not order
        (tmp_path / "mark").touch()
    finally:
        again.__exit__(None, None, None)
    waiting.join(10)
    assert order == ["second"]
