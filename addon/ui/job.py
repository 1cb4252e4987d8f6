# SPDX-License-Identifier: GPL-3.0-or-later
"""Place or Bake under way in a background Blender, and the one that is under way now.

The artist's own session is not touched: a copy of the .blend is saved to a temporary folder,
and a child process works on the copy.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy

from ..errors import InputError
from ..temporary_folder import TemporaryFolder
from ..writable import require_folder
from .background_process import BackgroundProcess

SCRIPT = Path(__file__).with_name("background_script.py")

# The variables that name the folder for temporary files, to Python and to Blender. The child's is
# in the job's own folder, so that what a killed child leaves there goes with the job.
_TEMPORARY = ("TMPDIR", "TEMP", "TMP")

# A verb of background_script and its arguments.
Step = tuple[str, Sequence[str]]

_current: Job | None = None


class Job:
    """One child process and what is known of its progress.

    Attributes:
        label: what it does, for the artist.
        scene_uid: the session_uid of the scene that it was started for.
        fraction: share done, [0, 1].
        message: what it is doing now.
        result: what the child gave at its end.
        error: one sentence once it has failed, else "".
        done: it has ended.

    Raises:
        InputError: the copy could not be saved, or the process not started.
    """

    def __init__(self, label: str, scene: Any, target: Path, steps: Sequence[Step]):
        self.label = label
        self.scene_uid = scene.session_uid
        self.fraction = 0.0
        self.message = "starting"
        self.result: dict[str, Any] = {}
        self.error = ""
        self.done = False
        self._target = target
        self._folder = TemporaryFolder()
        try:
            self._process = self._start(steps)
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(
                f"Blender cannot be started in the background: {reason}; free some space in the "
                "folder for temporary files, and some memory"
            ) from error

    def _start(self, steps: Sequence[Step]) -> BackgroundProcess:
        """The child, at work on a copy; the folder goes if there is none."""
        try:
            blend = save_copy(self._folder.path)
            temporary = self._folder.path / "temporary"
            temporary.mkdir()
            environment = os.environ | dict.fromkeys(_TEMPORARY, str(temporary))
            return BackgroundProcess(command(blend, steps), environment)
        except BaseException:
            self._folder.remove()
            raise

    def advance(self) -> None:
        """Take in what the child said since the last call."""
        if self.done:
            return
        status = self._process.status  # before the last events are read, so that none is missed
        for event in self._process.poll():
            self._take(event)
        if status is not None:
            if status != 0 and not self.error:
                lines = self._process.error_lines
                self.error = lines[-1] if lines else f"Blender ended with status {status}"
            self._finish()

    def _take(self, event: dict[str, Any]) -> None:
        if "progress" in event:
            self.fraction = min(max(float(event["progress"]), 0.0), 1.0)
            self.message = str(event.get("message", ""))
        if "error" in event:
            self.error = str(event["error"])
        if "result" in event:
            self.result = dict(event["result"])

    def stop(self) -> None:
        """End the child; what it has finished stays."""
        if not self.done:
            self.error = self.error or "stopped"
            self._process.stop()
            self._finish()

    def _finish(self) -> None:
        self.done = True
        self._process.stop()
        self._folder.remove()
        # What a stopped child was just writing; its number is in the temporary name.
        for part in self._target.rglob(f".*.{self._process.pid}.part"):
            part.unlink(missing_ok=True)


def save_copy(folder: Path) -> Path:
    """Save a copy of the open file into a folder; returns its path.

    The open file keeps its path and its unsaved changes. Relative paths inside the copy lead
    to the same files. An unsaved file can be copied too.

    Raises:
        InputError: Blender could not write it.
    """
    name = Path(bpy.data.filepath).name or "untitled.blend"
    blend = folder / name
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True, check_existing=False)
    except RuntimeError as error:
        raise InputError(f"the copy to work on could not be saved: {error}") from error
    return blend


def command(blend: Path, steps: Sequence[Step]) -> list[str]:
    """The child's command line: Blender itself, or Python where bpy is a module of it."""
    request = {
        "paths": [path for path in sys.path if path],
        "blend": str(blend),
        "steps": [[verb, list(arguments)] for verb, arguments in steps],
    }
    tail = [str(SCRIPT), "--", json.dumps(request)]
    if not bpy.app.binary_path:
        return [sys.executable, *tail]
    # Python inside the file runs in the child only if it was allowed to run here.
    scripts = "--disable-autoexec" if bpy.app.autoexec_fail else "--enable-autoexec"
    head = [bpy.app.binary_path, "--background", "--factory-startup", "-noaudio", scripts]
    return [*head, str(blend), "--python-exit-code", "1", "--python", *tail]


def current() -> Job | None:
    """The job under way, if there is one."""
    return _current if _current is not None and not _current.done else None


def start(label: str, scene: Any, target: Path, steps: Sequence[Step]) -> Job:
    """Start a job whose steps, done one after the other, write into the folder `target`.

    Raises:
        InputError: another one is under way, the folder cannot be written, or the copy could not
            be saved, or the process not started.
    """
    global _current  # noqa: PLW0603 - one at a time in a program, whatever file is open
    if current() is not None:
        raise InputError("Relume is already at work; wait for it or cancel it")
    require_folder(target)
    _current = Job(label, scene, target, steps)
    return _current


def stop_current() -> None:
    """End the job under way, if there is one."""
    job = current()
    if job is not None:
        job.stop()
