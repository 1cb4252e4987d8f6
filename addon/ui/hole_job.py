# SPDX-License-Identifier: GPL-3.0-or-later
"""The background process that bakes a view's holes: one at a time in a program."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..camplace.camera import CachingCamera
from ..camplace.cameras_file import write_cameras
from ..temporary_folder import TemporaryFolder
from ..writable import require_folder
from . import job

LABEL = "Filling holes"

_current: HoleJob | None = None
# The caches beside which this program had something baked.
_filled: set[Path] = set()


class HoleJob:
    """A job that bakes cameras into the temporary pictures beside a cache.

    Raises:
        InputError: as `job.Job`; or the cache's folder cannot be written.
    """

    def __init__(self, scene: Any, cache: Path, cameras: Sequence[CachingCamera]) -> None:
        """Saves a copy of the open file: only where Blender's operators may run."""
        require_folder(cache)
        self._folder = TemporaryFolder()
        self._gave_way = False
        try:
            path = self._folder.path / "cameras.json"
            write_cameras(path, tuple(cameras))
            arguments = ["--cache", str(cache), "--cameras", str(path)]
            self._job = job.Job(LABEL, scene, cache, [("fill", arguments)])
        except BaseException:
            self._clean()
            raise

    def advance(self) -> None:
        """Take in what the process said since the last call."""
        self._job.advance()
        if self._job.done:
            self._clean()

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return self._job.done

    @property
    def error(self) -> str:
        """One sentence once it has failed, else ""."""
        return self._job.error

    @property
    def is_superseded(self) -> bool:
        """Whether it has ended for another one to be started, and not by itself."""
        return self._gave_way and self.done and bool(self.error)

    @property
    def fraction(self) -> float:
        """Share done, [0, 1]."""
        return self._job.fraction

    @property
    def message(self) -> str:
        """What it is doing now."""
        return self._job.message

    def stop(self, *, waits: bool = False) -> None:
        """End the process; returns at once, since a view that moves on does not wait for it, or,
        if it `waits`, once nothing is written any more."""
        if waits:
            self._end()
        else:
            threading.Thread(target=self._end, daemon=True).start()

    def give_way(self) -> None:
        """As `stop`, for another one: what this one was to bake is wanted still."""
        self._gave_way = True
        self.stop()

    def _end(self) -> None:
        self._job.stop()
        self._clean()

    def _clean(self) -> None:
        self._folder.remove()


def current() -> HoleJob | None:
    """The job under way, if there is one."""
    return _current if _current is not None and not _current.done else None


def start(scene: Any, cache: Path, cameras: Sequence[CachingCamera]) -> HoleJob:
    """Start one, in the place of one under way. Raises as `HoleJob`."""
    global _current  # noqa: PLW0603 - one at a time in a program
    under_way = current()
    if under_way is not None:
        under_way.give_way()
    _filled.add(cache)
    _current = HoleJob(scene, cache, cameras)
    return _current


def filled_folders() -> tuple[Path, ...]:
    """The caches beside which this program had temporary pictures baked; forgets them."""
    folders = tuple(_filled)
    _filled.clear()
    return folders


def stop_current(*, waits: bool = False) -> None:
    """End the job under way, if there is one; see `HoleJob.stop`."""
    if _current is not None and not _current.done:
        _current.stop(waits=waits)
