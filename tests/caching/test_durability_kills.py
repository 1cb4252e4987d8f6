# SPDX-License-Identifier: GPL-3.0-or-later
"""Writers that are killed at any moment: no finished camera is lost, none is half another."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import count, groupby
from pathlib import Path

import pytest

from addon.caching.manifest_file import MANIFEST_NAME
from addon.caching.store import CacheStore
from addon.errors import InputError

from .killed_writer import (
    COUNT,
    MANIFEST,
    NEVER,
    bake_again,
    begun,
    first_bake,
    generation_of,
    new_world,
    picture,
    take_over,
    write,
)

KILLS = 120

# Up to a few times as long as all cameras take, so that kills fall everywhere.
LONGEST_LIFE = 0.1


@dataclass
class Writers:
    """Processes that are killed, one after the other; see `killed_writer`."""

    process: subprocess.Popen[str]

    def live(
        self, work: Callable[[Path, int], None], folder: Path, number: int, seconds: float
    ) -> list[tuple[str, int, int]]:
        """What one told until it was killed: (begin or done, camera, generation)."""
        pid = self._begin(work, folder, number, NEVER)
        time.sleep(seconds)
        os.kill(pid, signal.SIGKILL)
        told, status = self._end()
        # Not of itself, with an error.
        assert status == signal.SIGKILL
        return told

    def live_to_line(
        self, work: Callable[[Path, int], None], folder: Path, number: int, line: int
    ) -> bool:
        """Whether one was killed there; else it came to the end of its work before."""
        self._begin(work, folder, number, line)
        _, status = self._end()
        assert status in {0, signal.SIGKILL}
        return status == signal.SIGKILL

    def _begin(
        self, work: Callable[[Path, int], None], folder: Path, number: int, line: int
    ) -> int:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(f"{work.__name__} {folder} {number} {line}\n")
        word, pid = self.process.stdout.readline().split()
        assert word == "pid"
        return int(pid)

    def _end(self) -> tuple[list[tuple[str, int, int]], int]:
        assert self.process.stdout is not None
        told: list[tuple[str, int, int]] = []
        while True:
            word, *numbers = self.process.stdout.readline().split()
            if word == "ended":
                return told, int(numbers[0])
            told.append((word, int(numbers[0]), int(numbers[1])))


@pytest.fixture
def writers() -> Iterator[Writers]:
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.caching.killed_writer"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        bufsize=1,
        # A fork has only one of its threads.
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
    )
    with process:
        yield Writers(process)
        assert process.stdin is not None
        process.stdin.close()


def test_writers_killed_at_random(tmp_path: Path, writers: Writers) -> None:
    lives = random.Random(4)
    known: dict[int, int] = {}
    within = 0
    for number in range(1, KILLS + 1):
        may_be = {n: {generation} for n, generation in known.items()}
        seconds = lives.uniform(0.0, LONGEST_LIFE)
        is_within = False
        for word, n, generation in writers.live(write, tmp_path / "cache", number, seconds):
            if word == "done":
                may_be[n] = {generation}
                known[n] = generation
            else:
                may_be.setdefault(n, set()).add(generation)
            is_within = word == "begin"
        within += is_within
        if not known and not (tmp_path / "cache" / MANIFEST_NAME).exists():
            continue
        store = CacheStore.open(tmp_path / "cache")
        assert set(known) <= set(store.manifest.finished)
        for n in store.manifest.finished:
            known[n] = generation_of(store, n)
            assert known[n] in may_be[n]
    assert len(known) == COUNT
    # Most of a life is writing: the rest is reading what there is.
    assert within > KILLS / 4
    # What they left goes with the next bake after an hour, by the files' own time.
    parts = list(tmp_path.rglob(".*.part"))
    assert parts
    for part in parts:
        os.utime(part, (0.0, 0.0))
    begun(tmp_path / "cache", resume=True)
    assert not list(tmp_path.rglob(".*.part"))
    assert len(list((tmp_path / "cache" / "cameras").iterdir())) == COUNT


@pytest.fixture
def quick() -> Iterator[Path]:
    """A folder in memory where there is one: a kill does not ask what is on the disk yet."""
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(dir=memory) as folder:
        yield Path(folder)


def two_cameras(folder: Path) -> None:
    """Go on with a cache until it has both."""
    store = begun(folder, resume=True)
    for number in {0, 1} - set(store.manifest.finished):
        store.add_camera(picture(number, 1))


def test_killed_at_every_line_of_a_first_bake(quick: Path, writers: Writers) -> None:
    seen: list[tuple[int, ...] | None] = []
    for line in count():
        folder = quick / str(line)
        killed = writers.live_to_line(first_bake, folder, 0, line)
        if (folder / MANIFEST_NAME).exists():
            store = CacheStore.open(folder)
            assert all(generation_of(store, n) == 1 for n in store.manifest.finished)
            seen.append(tuple(store.manifest.finished))
        else:
            with pytest.raises(InputError, match="holds no Relume cache"):
                CacheStore.open(folder)
            seen.append(None)
        if not killed:
            break
        # Each is gone on with.
        two_cameras(folder)
        assert [generation_of(CacheStore.open(folder), n) for n in (0, 1)] == [1, 1]
    assert len(seen) > 60
    # In this order, and not back.
    assert [state for state, _ in groupby(seen)] == [None, (), (0,)]


def test_killed_at_every_line_of_baking_again(quick: Path, writers: Writers) -> None:
    """The earlier picture stays until the new one is in its place."""
    two_cameras(quick)
    now, moves = 1, []
    for line in count():
        killed = writers.live_to_line(bake_again, quick, now + 1, line)
        store = CacheStore.open(quick)
        assert generation_of(store, 1) == 1
        found = generation_of(store, 0)
        assert found in {now, now + 1}
        moves.append(found - now)
        now = found
        if not killed:
            break
    assert len(moves) > 60
    assert [move for move, _ in groupby(moves)] == [0, 1]


def test_killed_at_every_line_of_a_new_world(quick: Path, writers: Writers) -> None:
    two_cameras(quick)
    new_world(quick, 1)
    now, moves = 1, []
    for line in count():
        killed = writers.live_to_line(new_world, quick, now + 1, line)
        store = CacheStore.open(quick)
        found = int(store.manifest.world_fingerprint)
        assert (store.read_world(str(found)) == found).all()
        assert store.has_world(str(found))
        moves.append(found - now)
        now = found
        if not killed:
            break
    assert len(moves) > 60
    assert [move for move, _ in groupby(moves)] == [0, 1]


def test_killed_at_every_line_of_taking_over_edited_cameras(quick: Path, writers: Writers) -> None:
    """The cache holds the earlier cameras or the edited ones, and what was finished of both."""
    two_cameras(quick)
    far, moves = int(MANIFEST.cameras[1].far), []
    for line in count():
        killed = writers.live_to_line(take_over, quick, far + 1, line)
        store = CacheStore.open(quick)
        found = int(store.manifest.cameras[1].far)
        assert found in {far, far + 1}
        assert set(store.manifest.finished) == ({0, 1} if found == far else {0})
        assert {generation_of(store, n) for n in store.manifest.finished} == {1}
        moves.append(found - far)
        far = found
        if not killed:
            break
        if len(store.manifest.finished) == 1:
            store.add_camera(replace(picture(1, 1), camera=store.manifest.cameras[1]))
    assert len(moves) > 60
    assert [move for move, _ in groupby(moves)] == [0, 1]
