# SPDX-License-Identifier: GPL-3.0-or-later
"""`relume bake` that is killed, or finds the disk full, and goes on: as if baked in one go."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import pytest

from addon.caching.store import CacheStore
from addon.camplace.cameras_file import to_json
from tests.tools.test_command_line import ROOT

from .material_grid import add_plane, camera_above, empty_scene
from .small_disk import on_a_small_disk
from .test_materials import principled

# Each takes some hundredths of a second.
COUNT = 60


@dataclass(frozen=True)
class Shot:
    """A scene, a placement for it, and its cache, baked in one go."""

    scene: Path
    placement: Path
    cache: Path

    def words(self, cache: Path) -> list[str]:
        return [
            *(sys.executable, "-m", "tools.relume", "bake", str(self.scene)),
            *("--placement", str(self.placement), "--preset", "draft"),
            *("--cache", str(cache), "--resume", "--json"),
        ]

    def assert_right_so_far(self, cache: Path) -> int:
        """What is finished is what it is in the whole cache; how many cameras that are."""
        store, whole = CacheStore.open(cache), CacheStore.open(self.cache)
        for number in store.manifest.finished:
            assert store.is_intact(number)
            assert store.camera_path(number).read_bytes() == whole.camera_path(number).read_bytes()
        return len(store.read_finished())

    def assert_whole(self, cache: Path) -> None:
        """It is the same to the last byte."""
        assert self.assert_right_so_far(cache) == COUNT
        mine, whole = (json.loads((c / "manifest.json").read_text()) for c in (cache, self.cache))
        assert mine == whole
        names = [sorted(p.name for p in c.rglob("*.exr")) for c in (cache, self.cache)]
        assert names[0] == names[1]


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Shot:
    folder = tmp_path_factory.mktemp("shot")
    scene = empty_scene()
    add_plane(scene, "floor", (0.0, 0.0, 0.0), principled(), size=4.0)
    path = folder / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    cameras = tuple(camera_above((0, 0, 0), 2.0 + 0.1 * n, number=n) for n in range(COUNT))
    placement = folder / "cameras.json"
    placement.write_text(json.dumps(to_json(cameras)))
    shot = Shot(path, placement, folder / "cache")
    subprocess.run(shot.words(shot.cache), cwd=ROOT, check=True, capture_output=True, timeout=120)
    return shot


def finished_in(cache: Path) -> int:
    return len(CacheStore.open(cache).cameras) if (cache / "manifest.json").exists() else 0


def bake_and_kill(words: Sequence[str], cache: Path, count: int, seconds: float) -> None:
    """Kill it so long after so many cameras of the cache are finished."""
    with subprocess.Popen(
        words, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        while finished_in(cache) < count:
            assert process.poll() is None
            time.sleep(0.002)
        time.sleep(seconds)
        os.kill(process.pid, signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL


def test_a_bake_that_is_killed_three_times(shot: Shot, tmp_path: Path) -> None:
    cache, moments = tmp_path / "cache", random.Random(3)
    for count in (1, 15, 30):
        bake_and_kill(shot.words(cache), cache, count, moments.uniform(0.0, 0.1))
        finished = shot.assert_right_so_far(cache)
        assert count <= finished < COUNT
    run = subprocess.run(
        shot.words(cache), cwd=ROOT, capture_output=True, text=True, timeout=120, check=False
    )
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    assert (report["kept"], report["baked"]) == (finished, COUNT - finished)
    shot.assert_whole(cache)


# What memory's file system gives away at once.
PAGE = 4096

SCRIPT = """
disk=$1; out=$2; shift 2
"$@"; echo "status $?" >&2
cp -r $disk/cache $out/full
mount -o remount,size=64m $disk
"$@"; echo "status $?" >&2
cp -r $disk/cache $out/done
"""


def test_a_bake_onto_a_disk_that_fills_up(shot: Shot, tmp_path: Path) -> None:
    disk, out = tmp_path / "disk", tmp_path / "out"
    disk.mkdir()
    out.mkdir()
    sizes = [path.stat().st_size for path in shot.cache.rglob("*") if path.is_file()]
    # Half of what it takes, in whole pages.
    size = sum(-(-size // PAGE) for size in sizes) // 2 * PAGE
    words = ["sh", "-c", SCRIPT, "sh", disk, out, *shot.words(disk / "cache")]
    run = on_a_small_disk(disk, size, words)
    first, second = run.stderr.split("status ")[:2]
    assert second.startswith("2\n"), run.stderr
    assert run.stderr.endswith("status 0\n"), run.stderr
    line = first.rstrip().splitlines()[-1]
    assert line.startswith(f"relume bake: {disk}/cache/")
    assert line.endswith("cannot be written: the disk is full; free some space and do this again")
    assert "Traceback" not in run.stderr
    finished = shot.assert_right_so_far(out / "full")
    assert 0 < finished < COUNT
    assert not list(out.rglob("*.part"))
    report = json.loads(run.stdout)
    assert (report["kept"], report["baked"]) == (finished, COUNT - finished)
    shot.assert_whole(out / "done")
