# SPDX-License-Identifier: GPL-3.0-or-later
"""The operating system's locks on open files; they end with the process, however that ends."""

from __future__ import annotations

import sys
from typing import BinaryIO

if sys.platform == "win32":
    import msvcrt
    import time

    # There is no lock that waits for longer than ten tries.
    _RETRY_SECONDS = 0.05

    def lock(file: BinaryIO) -> None:
        """Wait until no one else holds the lock, and take it. Raises OSError."""
        while not try_lock(file):
            time.sleep(_RETRY_SECONDS)

    def try_lock(file: BinaryIO) -> bool:
        """Take the lock; False if another one holds it. Raises OSError."""
        try:
            file.seek(0)
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except PermissionError:
            return False
        return True

    def unlock(file: BinaryIO) -> None:
        """Let the lock go."""
        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_UNLCK, 1)

else:
    import fcntl

    def lock(file: BinaryIO) -> None:
        """Wait until no one else holds the lock, and take it. Raises OSError."""
        fcntl.flock(file, fcntl.LOCK_EX)

    def try_lock(file: BinaryIO) -> bool:
        """Take the lock; False if another one holds it. Raises OSError."""
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True

    def unlock(file: BinaryIO) -> None:
        """Let the lock go."""
        fcntl.flock(file, fcntl.LOCK_UN)
