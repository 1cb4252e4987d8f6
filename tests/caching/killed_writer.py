# SPDX-License-Identifier: GPL-3.0-or-later
"""Works on caches in processes that are killed; the next one starts within milliseconds.

    python -m tests.caching.killed_writer

For each line on standard input, `WORK FOLDER NUMBER LINE`, it forks a process that does the work
of this name in the folder, and is killed before it comes to so many lines of the code that
writes. On standard output are

    pid PID
    begin CAMERA GENERATION    (these two from `write`)
    done CAMERA GENERATION
    ended STATUS
"""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from addon.caching.bake_settings import BakeSettings, prepare_store
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.manifest import Manifest
from addon.caching.plan import ChannelPlan
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera

COUNT = 6
SIDE = 48
PLAN = ChannelPlan(("depth", "diffuse_color"), {"material_id": (1.0,)}, ("grey",))

# The code of which every line is a moment to be killed at, with Python's own between the opening
# of a text and its writing; but for what only computes.
WRITING = (
    str(Path("addon", "caching", "bake_settings.py")),
    str(Path("addon", "caching", "folder_lock.py")),
    str(Path("addon", "caching", "manifest_file.py")),
    str(Path("addon", "caching", "store.py")),
    str(Path("addon", "caching", "sweep.py")),
    str(Path("addon", "whole_file.py")),
    str(Path("pathlib", "_abc.py")),
)
COMPUTING = (
    *("to_json", "from_json", "continues", "<genexpr>", "<lambda>", "__init__"),
    *("_require_version", "camera_path", "picture_path"),
)

# Instead of a line.
NEVER = -1

# Generations of one writer begin here, times its number.
GENERATIONS = 10_000


def camera(number: int) -> CachingCamera:
    """One of the cameras that are written."""
    return CachingCamera(number, np.eye(4), 1.0, 0.1, 10.0, SIDE, "CUBE_FACE", 0)


MANIFEST = Manifest("scene", {"preset": "draft"}, PLAN, tuple(camera(i) for i in range(COUNT)))


def picture(number: int, generation: int) -> DeepFramebuffer:
    """Noise that no other camera and no other generation has; half precision holds all of it."""
    random_bits = np.random.default_rng((number, generation))
    channels = {
        # Nine bits, in halves' own spacing.
        name: (random_bits.integers(512, 1024, (SIDE, SIDE, count)) / 1024.0).astype(np.float32)
        for name, count in (("depth", 1), ("diffuse_color", 3))
    }
    # What it is stands in its corner.
    channels["depth"][0, 0, 0], channels["depth"][0, 1, 0] = number, generation
    return DeepFramebuffer(camera(number), channels)


def generation_of(store: CacheStore, number: int) -> int:
    """Which generation of a camera a cache holds; all of its texels have to be of that one."""
    found = store.read_camera(number)
    depth = found.channels["depth"]
    assert depth[0, 0, 0] == number
    generation = int(depth[0, 1, 0])
    for name, values in picture(number, generation).channels.items():
        np.testing.assert_array_equal(found.channels[name], values)
    return generation


def _say(*words: object) -> None:
    os.write(1, (" ".join(map(str, words)) + "\n").encode())


def begun(
    folder: Path, manifest: Manifest = MANIFEST, *, resume: bool = False, overwrite: bool = False
) -> CacheStore:
    """The cache that a bake goes on with, or begins."""
    return prepare_store(folder, manifest, BakeSettings(resume=resume, overwrite=overwrite))


def write(folder: Path, writer: int) -> None:
    """All cameras again and again, without end."""
    store = begun(folder, resume=True)
    order = random.Random(writer)
    generation = writer * GENERATIONS
    # First what is missing, as a bake that goes on does; then all of it again.
    todo = [number for number in range(COUNT) if not store.is_intact(number)]
    while True:
        for number in todo:
            generation += 1
            _say("begin", number, generation)
            store.add_camera(picture(number, generation))
            _say("done", number, generation)
        todo = order.sample(range(COUNT), COUNT)


def first_bake(folder: Path, number: int) -> None:
    """A cache in a new folder, with one camera."""
    begun(folder).add_camera(picture(number, 1))


def bake_again(folder: Path, generation: int) -> None:
    """One camera of a cache."""
    CacheStore.open(folder).add_camera(picture(0, generation))


def new_world(folder: Path, number: int) -> None:
    """A picture of the world."""
    world = np.full((2, 4, 3), number, np.float32)
    CacheStore.open(folder).add_world(world, str(number))


def take_over(folder: Path, far: int) -> None:
    """Begin a bake with one other camera, and keep those that are the same."""
    edited = replace(MANIFEST.cameras[1], far=float(far))
    cameras = (MANIFEST.cameras[0], edited, *MANIFEST.cameras[2:])
    begun(folder, replace(MANIFEST, cameras=cameras), resume=True, overwrite=True)


_WORKS: dict[str, Callable[[Path, int], None]] = {
    work.__name__: work for work in (write, first_bake, bake_again, new_world, take_over)
}


def _die_at(last: int) -> None:
    """Have this process killed before the line `last` of `WRITING`."""
    left = last

    def count(frame: FrameType, event: str, argument: object) -> Any:
        nonlocal left
        code = frame.f_code
        if code.co_name in COMPUTING or not code.co_filename.endswith(WRITING):
            return None
        if event == "line":
            left -= 1
            if left < 0:
                os.kill(os.getpid(), signal.SIGKILL)
        return count

    sys.settrace(count)


def _do(work: str, folder: str, number: str, line: str) -> None:
    status = 1
    try:
        _say("pid", os.getpid())
        if int(line) != NEVER:
            _die_at(int(line))
        _WORKS[work](Path(folder), int(number))
        status = 0
    finally:
        sys.settrace(None)
        os._exit(status)


def _main() -> None:
    # What loads at its first use loads here, once.
    with tempfile.TemporaryDirectory() as folder:
        first_bake(Path(folder), 0)
        generation_of(CacheStore.open(Path(folder)), 0)
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            _do(*line.split())
        _, status = os.waitpid(child, 0)
        _say("ended", status)


if __name__ == "__main__":
    _main()
