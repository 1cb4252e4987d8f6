# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders for temporary files, which do not outlive the program for long.

A process that is killed removes nothing. So each folder holds a file that is locked as long as its
process lives, in whatever container that is; who makes the next folder removes those that nobody
holds any more.
"""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

from .errors import InputError
from .file_lock import try_lock

PREFIX = "relume-"
_HOLD_NAME = ".held"

# A folder is held within moments of being made, and what a killed process started ends within a
# minute (ui/background_script.py).
_YOUNG_S = 120.0


class TemporaryFolder:
    """A new folder in the one for temporary files; `remove`, or the end of a `with` block, or at
    the latest somebody's next one ends it.

    Attributes:
        path: where it is.

    Raises:
        InputError: none can be made there.
    """

    def __init__(self) -> None:
        remove_left_behind()
        try:
            self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
            self._held = _hold(self.path)
        except OSError as error:
            raise InputError(
                f"no folder for temporary files can be made ({error.strerror or error}); free some "
                "space, or name another place in the environment variable TMPDIR"
            ) from error

    def remove(self) -> None:
        """Remove it with all that is in it; as much as can be, and nothing the second time."""
        # Windows removes no open file.
        self._held.close()
        shutil.rmtree(self.path, ignore_errors=True)

    def __enter__(self) -> Path:
        return self.path

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.remove()


def _hold(folder: Path) -> BinaryIO:
    """The file that says that this process uses a folder; without it, the folder goes."""
    try:
        file = (folder / _HOLD_NAME).open("wb")
    except OSError:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    # Some file systems have no locks. There every try fails, and nothing is taken for left behind.
    with suppress(OSError):
        try_lock(file)
    return file


def remove_left_behind() -> None:
    """Remove this user's folders whose processes are gone, if they are old enough."""
    with suppress(OSError):
        for entry in os.scandir(tempfile.gettempdir()):
            if entry.name.startswith(PREFIX) and _is_left_behind(Path(entry.path)):
                shutil.rmtree(entry.path, ignore_errors=True)


def _is_left_behind(folder: Path) -> bool:
    """Whether a folder was made as above, and nobody holds it any more."""
    try:
        # What another user put there, or a link, is not looked into.
        known = folder.lstat()
        if not stat.S_ISDIR(known.st_mode) or known.st_uid != _user():
            return False
        hold = folder / _HOLD_NAME
        if time.time() - hold.lstat().st_mtime < _YOUNG_S:
            return False
        with hold.open("rb+") as file:
            return try_lock(file)
    except OSError:
        return False


def _user() -> int:
    """As `st_uid` has it, which on Windows is always 0."""
    return os.getuid() if hasattr(os, "getuid") else 0
