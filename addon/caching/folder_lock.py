# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets one process at a time change a folder."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

LOCK_NAME = ".lock"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Wait until no other process is in such a block for `folder`, and run it.

    The lock is the operating system's and ends with the process that holds it, however that
    ends; the empty file that it is held on stays behind.

    Raises:
        OSError: the folder is missing or cannot be written.
    """
    path = folder / LOCK_NAME
    while True:
        with path.open("ab") as file:
            _lock(file)
            try:
                if _is(file, path):
                    yield
                    return
            finally:
                _unlock(file)


def _is(file: BinaryIO, path: Path) -> bool:
    """Whether the open file is the one that others find there: who waited for a lock in a folder
    that was removed and made again holds the lock on a file that is gone."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    except FileNotFoundError:
        return False


if sys.platform == "win32":
    import msvcrt
    import time

    # There is no lock that waits for longer than ten tries.
    _RETRY_SECONDS = 0.05

    def _lock(file: BinaryIO) -> None:
        while True:
            try:
                file.seek(0)
                msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            except PermissionError:
                time.sleep(_RETRY_SECONDS)
            else:
                return

    def _unlock(file: BinaryIO) -> None:
        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_UNLCK, 1)

else:
    import fcntl

    def _lock(file: BinaryIO) -> None:
        fcntl.flock(file, fcntl.LOCK_EX)

    def _unlock(file: BinaryIO) -> None:
        fcntl.flock(file, fcntl.LOCK_UN)
