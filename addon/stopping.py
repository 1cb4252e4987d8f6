# SPDX-License-Identifier: GPL-3.0-or-later
"""Ctrl+C and SIGTERM end a process in order: what was begun is undone, what is done is kept.

Python raises KeyboardInterrupt wherever it happens to be. While Blender renders, that is one of
its callbacks, and Blender prints and forgets what a callback raises. So the signals wait while
`uninterrupted` and are raised after it; and where one was lost all the same, `stoppable` stops
the work the next time that it tells its progress. Only the first signal is raised: who holds
Ctrl+C down would otherwise interrupt the undoing too.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .progress import Progress

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stopped(KeyboardInterrupt):
    """What a signal raises.

    Not KeyboardInterrupt itself: once that has left an `exec` of text, as dataclasses make, Python
    ends by SIGINT in place of its exit status, although it was caught.
    """


class _Request:
    """What the signals of this process have asked for.

    Attributes:
        made: a signal came.
        waits: it came in an `uninterrupted` block and was not raised yet.
        blocks: how many such blocks, one inside the other, are under way.
        programs: how many `stop_signals` blocks are.
    """

    made = False
    waits = False
    blocks = 0
    programs = 0


_request = _Request()


def _on_signal(number: int, frame: Any) -> None:  # noqa: ARG001 - as `signal` calls it
    if _request.made:
        return
    _request.made = True
    if _request.blocks:
        _request.waits = True
    else:
        raise Stopped


@contextmanager
def stop_signals() -> Iterator[None]:
    """In this block the first Ctrl+C or SIGTERM raises KeyboardInterrupt; for all of a program.

    Once one came, further ones are ignored, also after the block: the process is about to end.
    A signal that the process was started to ignore is still ignored. Outside of the main thread,
    where Python takes no signals, and in another such block this changes nothing.

    Raises:
        KeyboardInterrupt: in place of any error, once a signal has come: it may be what became
            of the interrupt, for instance where a library was being loaded.
    """
    if threading.current_thread() is not threading.main_thread() or _request.programs:
        yield
        return
    taken = [number for number in _SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
    _request.made = _request.waits = False
    earlier = {number: signal.signal(number, _on_signal) for number in taken}
    _request.programs += 1
    try:
        yield
    except Exception:
        if _request.made:
            raise Stopped from None
        raise
    finally:
        _request.programs -= 1
        for number, handler in earlier.items():
            # None is a handler that is not Python's, which cannot be put back. Python's own end
            # puts back every handler but SIG_IGN, and a late signal would be the exit status.
            after = signal.SIG_DFL if handler is None else handler
            signal.signal(number, signal.SIG_IGN if _request.made else after)


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
            raise Stopped


def stoppable(progress: Progress) -> Progress:
    """The same, but it raises KeyboardInterrupt once a signal has come."""

    def tell(fraction: float, message: str) -> None:
        if _request.made:
            raise Stopped
        progress(fraction, message)

    return tell
