# SPDX-License-Identifier: GPL-3.0-or-later
"""How much longer a row of pictures of several sizes takes, from those that are done."""

from __future__ import annotations

from collections.abc import Sequence

# (a picture's texels, the seconds that it took).
Timed = tuple[int, float]

_MINUTE = 60.0

# Below this a number would be gone before it is read.
_FEW_SECONDS = 5.0


def seconds_left(done: Sequence[Timed], texels: Sequence[int]) -> float | None:
    """The seconds that pictures of so many `texels` each still take; None while none is done.

    A picture takes some seconds of its own and some for each texel: the least squares' line
    through the pictures that are done, of which neither part is negative. The first picture also
    bears what is prepared once for all of them, so it does not count as soon as a second is
    done; until then it makes the answer too large rather than too small.
    """
    if not done:
        return None
    own, each = _line(done[1:] or done)
    return own * len(texels) + each * sum(texels)


def time_left(done: Sequence[Timed], texels: Sequence[int]) -> str:
    """The same in words, to be put behind a message: ", about 40 s left"; "" for nothing known.

    After the first picture alone it is said as what it is, a bound: ", less than 2 min left".
    """
    seconds = seconds_left(done, texels)
    if seconds is None or not texels:
        return ""
    if seconds < _FEW_SECONDS:
        return ", a few seconds left"
    return f", {'less than' if len(done) == 1 else 'about'} {_round(seconds)} left"


def _line(done: Sequence[Timed]) -> tuple[float, float]:
    """Seconds of a picture's own and of each texel, neither negative."""
    mean_texels = sum(texels for texels, _ in done) / len(done)
    mean_seconds = sum(seconds for _, seconds in done) / len(done)
    spread = sum((texels - mean_texels) ** 2 for texels, _ in done)
    together = sum((texels - mean_texels) * (seconds - mean_seconds) for texels, seconds in done)
    through_zero = mean_seconds / mean_texels
    if spread == 0.0:
        # Pictures of one size do not tell the two parts apart; for more of that size it is one.
        return 0.0, through_zero
    each = together / spread
    if each <= 0.0:
        return mean_seconds, 0.0
    own = mean_seconds - each * mean_texels
    if own < 0.0:
        # The line through zero that is nearest to all of them.
        square = sum(texels**2 for texels, _ in done)
        return 0.0, sum(texels * seconds for texels, seconds in done) / square
    return own, each


def _round(seconds: float) -> str:
    """As finely as such a guess is worth saying: upwards to 5 s, 10 s, whole minutes."""
    if seconds <= 30.0:
        return f"{_up(seconds, 5.0)} s"
    if seconds <= _MINUTE - 10.0:
        return f"{_up(seconds, 10.0)} s"
    minutes = _up(seconds, _MINUTE) // 60
    if minutes < 60:
        return f"{minutes} min"
    return f"{minutes // 60} h {minutes % 60} min" if minutes % 60 else f"{minutes // 60} h"


def _up(seconds: float, step: float) -> int:
    return int(-(-seconds // step) * step)
