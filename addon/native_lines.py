# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps back lines that C code writes to standard error, which `sys.stderr` does not see."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_lines(start: bytes) -> Iterator[None]:
    """Keep lines that begin so, which C code writes in this block, from standard error.

    The others are written when the block ends, however it ends.

    Raises:
        OSError: the folder for temporary files cannot be written.
    """
    with tempfile.TemporaryFile() as told:
        sys.stderr.flush()
        kept = os.dup(2)
        os.dup2(told.fileno(), 2)
        try:
            yield
        finally:
            sys.stderr.flush()
            os.dup2(kept, 2)
            os.close(kept)
            told.seek(0)
            os.write(2, b"".join(line for line in told if not line.startswith(start)))
