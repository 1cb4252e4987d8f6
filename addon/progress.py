# SPDX-License-Identifier: GPL-3.0-or-later
"""How long work tells its caller how far it is, and how the caller stops it."""

from __future__ import annotations

from collections.abc import Callable

# (share done in [0, 1], what is being done). It may raise Cancelled to stop the work.
Progress = Callable[[float, str], None]


class Cancelled(Exception):
    """The caller asked to stop; what was finished is kept, the rest is undone."""


def part_of(progress: Progress, start: float, end: float) -> Progress:
    """A Progress for a step that is the share from `start` to `end` of the whole."""
    return lambda fraction, message: progress(start + (end - start) * fraction, message)


def silent(fraction: float, message: str) -> None:
    """A Progress that says nothing."""
