# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets one process at a time change a folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from ..file_lock import lock, unlock

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
            lock(file)
            try:
                if _is(file, path):
                    yield
                    return
            finally:
                unlock(file)


def _is(file: BinaryIO, path: Path) -> bool:
    """Whether the open file is the one that others find there: who waited for a lock in a folder
    that was removed and made again holds the lock on a file that is gone."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    except FileNotFoundError:
        return False
