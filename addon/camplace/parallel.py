# SPDX-License-Identifier: GPL-3.0-or-later
"""Work on long arrays, several parts at once."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from itertools import pairwise, starmap

# More threads than this mostly wait for memory.
MOST_THREADS = 8


def in_parts(work: Callable[[slice], None], count: int, part: int) -> None:
    """Call `work` for even slices of at most `part` that together are the first `count` rows.

    Embree and numpy's loops free Python's lock, so threads help. `work` writes its own rows of
    arrays and no others, so the result does not depend on the number of threads. The caller's
    thread works too and waits for no thread that has not begun: on a busy machine that is never
    slower than working alone.
    """
    number = -(-count // part)
    ends = [count * i // number for i in range(number + 1)] if number else []
    parts = deque(starmap(slice, pairwise(ends)))

    def take() -> None:
        while True:
            try:
                some = parts.popleft()
            except IndexError:
                return
            work(some)

    helpers = [_pool().submit(take) for _ in range(min(_threads(), number) - 1)]
    try:
        take()
    finally:
        parts.clear()
        begun = [helper for helper in helpers if not helper.cancel()]
        wait(begun)
    for helper in begun:
        helper.result()


def _threads() -> int:
    return min(MOST_THREADS, os.process_cpu_count() or 1)


@cache
def _pool() -> ThreadPoolExecutor:
    """Made once: starting threads takes longer than many a batch of rays."""
    return ThreadPoolExecutor(_threads(), thread_name_prefix="relume-place")
