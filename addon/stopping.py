# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl+C and SIGTERM end a process in order: what was begun is undone, what is done is kept.

Python raises KeyboardInterrupt wherever it happens to be. While Blender renders, that is one of
its callbacks, and Blender prints and forgets what a callback raises. So the signals wait while
`uninterrupted` and are raised after it; and where one was lost all the same, `stoppable` stops
the work the next time that it tells its progress.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .progress import Progress

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class _Request:
    """What the signals of this process have asked for.

    Attributes:
        made: a signal came.
        waits: it came in an `uninterrupted` block and was not raised yet.
        blocks: how many such blocks, one inside the other, are under way.
    """

    made = False
    waits = False
    blocks = 0


_request = _Request()


def _on_signal(number: int, frame: Any) -> None:  # noqa: ARG001 - as `signal` calls it
    _request.made = True
    if _request.blocks:
        _request.waits = True
    else:
        raise KeyboardInterrupt


@contextmanager
def stop_signals() -> Iterator[None]:
    """In this block Ctrl+C and SIGTERM both raise KeyboardInterrupt; for the whole of a program.

    A signal that the process was started to ignore is still ignored. Outside of the main thread,
    where Python takes no signals, this does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _request.made = _request.waits = False
    taken = [number for number in _SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    earlier = {number: signal.signal(number, _on_signal) for number in taken}
    try:
        yield
    finally:
        for number, handler in earlier.items():
            # None is a handler that is not Python's, which cannot be put back.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Let a signal that comes in this block wait for its end.

    Raises:
        KeyboardInterrupt: at the end of the block, if one came.
    """
    _request.blocks += 1
    try:
        yield
    finally:
        _request.blocks -= 1
        if _request.waits and not _request.blocks:
            _request.waits = False
            raise KeyboardInterrupt


def stoppable(progress: Progress) -> Progress:
    """The same, but it raises KeyboardInterrupt once a signal has come."""

    def tell(fraction: float, message: str) -> None:
        if _request.made:
            raise KeyboardInterrupt
        progress(fraction, message)

    return tell
