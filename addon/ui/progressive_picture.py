# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport's picture, step by step: small while the view moves, then full, then anti-aliased."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..corrmap.move_budget import MoveBudget, smaller
from ..scene.view import View, same_view

if TYPE_CHECKING:
    from ..glsl.shader import Texture

# Samples are drawn for at most so long before the interface gets its turn, in seconds.
BUSY_S = 0.05
# A view that has stood still for so long, in seconds, gets all its pixels. Less is the pause
# between two turns of a mouse wheel.
SETTLE_S = 0.2
# Where the full picture is expected to take longer than this, seconds, pictures of half of its
# resolution, of half of that, and so on come before it; they take a third of its time together.
STEP_S = 0.25
# The first picture of a moving view may take this long, however small its budget; then what
# there is of it is shown, in seconds.
PATIENCE_S = 0.25


class Session(Protocol):
    """What is needed of a `RelightSession`."""

    compiling: str

    def set_view(self, view: View) -> None: ...

    def step(self, *, announce: bool = False) -> bool: ...

    def draw_combined(self) -> Any: ...

    @property
    def shown_stride(self) -> int: ...


@dataclass
class PictureTimes:
    """Seconds from the last change of the view or the scene to each step of the picture.

    Attributes:
        first: to the first whole picture of it, of whatever resolution.
        divisor: view pixels along the side of a pixel of that one.
        full: to the first one of full resolution.
        last: to the finished one.
    """

    first: float | None = None
    divisor: int = 1
    full: float | None = None
    last: float | None = None

    def lines(self) -> list[tuple[str, str]]:
        """What each step is and how long it took, of those that came."""
        of = "" if self.divisor == 1 else f" (1/{self.divisor} resolution)"
        steps = ((f"First{of}", self.first), ("Full resolution", self.full), ("Last", self.last))
        return [(name, in_words(seconds)) for name, seconds in steps if seconds is not None]


def in_words(seconds: float) -> str:
    """A time as it is shown: "14 ms", "2.3 s"."""
    return f"{1000.0 * seconds:.0f} ms" if seconds < 1.0 else f"{seconds:.1f} s"


class ProgressivePicture:
    """Refines one viewport's picture.

    A picture that shows the present view stays until a finer one of that view is whole, so that
    no step makes it coarser, and none shows half of the lights.

    Attributes:
        texture: the picture to show, drawn over the whole viewport; None before the first.
        times: of its steps.

    Args:
        clock: seconds, for measuring.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self._budget = MoveBudget()
        self._view: View | None = None
        self._changed_at = -np.inf
        self._moving = False
        self._divisor = 1
        self._compiles = False
        # View pixels along the side of one that is shown of the present view: 0 for none, and
        # infinite for one of the scene before it changed.
        self._shown = 0.0
        self.texture: Texture | None = None
        self.times = PictureTimes()

    @property
    def divisor(self) -> int:
        """View pixels along the side of a pixel that is drawn at present."""
        return self._divisor

    @property
    def is_moving(self) -> bool:
        """Whether the view has not stood still for long."""
        return self._moving

    def replace(self, texture: Texture) -> None:
        """Show a picture that was drawn elsewhere."""
        self.texture, self._shown = texture, 0.0

    def note_change(self) -> None:
        """The scene changed: what is shown stays until there is a whole picture of it as it is
        now, however coarse; and times count from now."""
        self._shown = np.inf if self._shown else 0.0
        self._changed_at = self._clock()
        self.times = PictureTimes()

    def refine(self, session: Session, view: View, budget_s: float) -> bool:
        """Bring the picture a little further; True while it is not finished.

        Args:
            session: draws it.
            view: of the whole viewport.
            budget_s: seconds for a picture of a moving view; 0 for full resolution always.
        """
        start = self._clock()
        self._follow(view, start, budget_s)
        # What is announced now is compiled the next time.
        compiles, is_first = self._compiles, self._shown == 0.0
        if self._moving:
            unfinished = self._draw_moving(session, view)
        else:
            unfinished = self._draw_still(session, view, start)
        self._show(session)
        self._compiles = bool(session.compiling)
        if self._moving and is_first and not (compiles or self._compiles):
            self._budget.took(self._divisor, self._clock() - start)
        if not unfinished and self._divisor == 1 and self.times.last is None:
            self.times.last = self._clock() - self._changed_at
        # A small picture is never the last one.
        return unfinished or self._divisor > 1

    def _follow(self, view: View, now: float, budget_s: float) -> None:
        """Whether the view moves, and how large it is drawn."""
        if self._view is None or not same_view(view, self._view):
            # Where nothing is shown yet, there is nothing to move.
            self._moving = budget_s > 0.0 and self._view is not None
            self._view, self._changed_at, self._shown = view, now, 0.0
            self.times = PictureTimes()
            pixels = view.width * view.height
            self._divisor = self._budget.choose(budget_s, pixels) if self._moving else 1
        elif self._moving and (now - self._changed_at >= SETTLE_S or budget_s <= 0.0):
            self._moving = False
            self._divisor = self._finer()
        elif not self._moving and 0.0 < self._shown <= self._divisor:
            self._divisor = self._finer()

    def _finer(self) -> int:
        """The next step on the way to full resolution: so that a move interrupts it soon."""
        full = self._budget.expected(1)
        if full is None or full <= STEP_S:
            return 1
        return max(1, self._divisor // 2)

    def _draw_moving(self, session: Session, view: View) -> bool:
        """Until there is a whole picture, and then a sample at a time; whether more are wanted."""
        start = self._clock()
        session.set_view(smaller(view, self._divisor))
        limit = PATIENCE_S if self._shown == 0.0 else 0.0
        while True:
            unfinished = session.step(announce=True)
            late = self._clock() - start >= limit
            if late or session.compiling or not unfinished or session.shown_stride == 1:
                return unfinished

    def _draw_still(self, session: Session, view: View, start: float) -> bool:
        """Samples for a moment; whether more are wanted."""
        session.set_view(smaller(view, self._divisor))
        unfinished = True
        while unfinished and self._clock() - start < BUSY_S:
            unfinished = session.step(announce=True)
            # Of a smaller picture one sample is enough.
            if session.compiling or (self._divisor > 1 and session.shown_stride == 1):
                break
        return unfinished

    def _show(self, session: Session) -> None:
        """Show what the session has, unless it is less than what is shown of this view."""
        stride = session.shown_stride
        pixel = self._divisor * stride
        if self._shown > 0.0 and (pixel == 0 or pixel > self._shown):
            return
        self.texture = session.draw_combined()
        if stride == 0:
            return
        self._shown = float(pixel)
        since = self._clock() - self._changed_at
        if self.times.first is None:
            self.times.first, self.times.divisor = since, pixel
        if pixel == 1 and self.times.full is None:
            self.times.full = since
