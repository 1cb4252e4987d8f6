# SPDX-License-Identifier: GPL-3.0-or-later
"""Work for the thread of Blender's interface, from the thread of a render.

Only the interface's thread may run operators, and only it can draw with the GPU while its windows
go on being drawn: a render that asks Blender for a GPU context keeps all viewports and image
editors from being drawn until it ends, and with them the interface, its progress and Esc.
"""

from __future__ import annotations

import queue
import threading
import traceback
from collections.abc import Callable
from types import TracebackType
from typing import Any

import bpy

from ..progress import Cancelled

# How often the interface looks for work, and a waiting render whether it was cancelled; in seconds.
_TICK_S = 0.01
_PATIENCE_S = 0.1


class _Call[T]:
    """Something to do, and what came of it."""

    def __init__(self, work: Callable[[], T]) -> None:
        self.done = threading.Event()
        self._work = work
        self._result: list[T] = []
        self._error: BaseException | None = None
        self._lock = threading.Lock()
        self._is_taken = False

    def take(self) -> bool:
        """Whether nobody has taken it, to do it or to give it up; only one is told so."""
        with self._lock:
            first, self._is_taken = not self._is_taken, True
        return first

    def run(self) -> None:
        """Do it, unless it was given up."""
        if not self.take():
            return
        try:
            self._result.append(self._work())
        except BaseException as error:  # noqa: BLE001 - it is raised where it is waited for
            let_go(error)
            self._error = error
        self.done.set()

    def result(self) -> T:
        """What came of it."""
        if self._error is not None:
            raise self._error
        return self._result[0]


class MainThread:
    """Does a render's work in the interface's thread, one piece after the other, in a `with` block.

    Where the render itself runs there, as without an interface, it does it at once. A script in
    the interface that waits for a render which it started lets nobody look for the work: it would
    wait for ever.

    Args:
        is_cancelled: whether the render is to end, and waits no longer.
    """

    def __init__(self, is_cancelled: Callable[[], bool]) -> None:
        self._is_cancelled = is_cancelled
        self._is_here = threading.current_thread() is threading.main_thread()
        self._calls: queue.SimpleQueue[_Call[Any]] = queue.SimpleQueue()
        self._closed = threading.Event()

    def __enter__(self) -> MainThread:
        if not self._is_here:
            bpy.app.timers.register(self._pump)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._closed.set()

    def do[T](self, work: Callable[[], T]) -> T:
        """What `work` returns or raises.

        Raises:
            Cancelled: the render was cancelled before it began.
        """
        if self._is_here:
            return work()
        call = _Call(work)
        self._calls.put(call)
        while not call.done.wait(_PATIENCE_S):
            if self._is_cancelled() and call.take():
                raise Cancelled
        return call.result()

    def finish(self, work: Callable[[], None]) -> None:
        """Have `work` done whatever happens; a render that is cancelled does not wait for it."""
        if self._is_here:
            work()
            return
        call = _Call(work)
        self._calls.put(call)
        while not call.done.wait(_PATIENCE_S) and not self._is_cancelled():
            pass

    def _pump(self) -> float | None:
        """The timer: one piece of work, and the interface is drawn before the next."""
        # Asked first: what the render leaves last is there by then.
        is_closed = self._closed.is_set()
        try:
            self._calls.get_nowait().run()
        except queue.Empty:
            return None if is_closed else _TICK_S
        return 0.0


def let_go(error: BaseException | None) -> None:
    """Drop what the frames that an error came through hold: a session's textures, say, which would
    else be freed in the thread that handles the error, without a GPU context."""
    while error is not None:
        traceback.clear_frames(error.__traceback__)
        error = error.__context__
