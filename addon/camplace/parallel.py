# SPDX-License-Identifier: GPL-3.0-or-later
"""Work on long arrays, several parts at once."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache

# More threads than this mostly wait for memory.
MOST_THREADS = 8


def in_parts(work: Callable[[slice], None], count: int, part: int) -> None:
    """Call `work` for slices of at most `part` that together are the first `count` rows.

    Embree and numpy's loops free Python's lock, so threads help. `work` writes its own rows of
    arrays and no others, so the result does not depend on the number of threads; it must not
    call `in_parts` itself, which could wait for ever.
    """
    parts = [slice(start, min(start + part, count)) for start in range(0, count, part)]
    if len(parts) < 2 or _threads() < 2:
        for some in parts:
            work(some)
        return
    list(_pool().map(work, parts))


def _threads() -> int:
    return min(MOST_THREADS, os.process_cpu_count() or 1)


@cache
def _pool() -> ThreadPoolExecutor:
    """Made once: starting threads takes longer than many a batch of rays."""
    return ThreadPoolExecutor(_threads(), thread_name_prefix="relume-place")
