# SPDX-License-Identifier: GPL-3.0-or-later
"""Kinds of command line arguments, for `argparse`'s `type` and `action`."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Blender's MAXFRAME; its own first frame is the negative of it.
LAST_FRAME = 1_048_574


def count(text: str) -> int:
    """A whole number of at least 0."""
    try:
        number = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number") from None
    if number < 0:
        raise argparse.ArgumentTypeError(f"{number} is less than 0")
    return number


def positive(text: str) -> int:
    """A whole number of at least 1."""
    number = count(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number} is less than 1")
    return number


def amount(text: str) -> float:
    """A finite number above 0."""
    number = _finite(text)
    if number <= 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return number


def share(text: str) -> float:
    """A number from 0 to 1."""
    number = _finite(text)
    if not 0.0 <= number <= 1.0:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and 1")
    return number


def _finite(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number")
    return number


def names(text: str) -> tuple[str, ...]:
    """One name or more, between commas."""
    found = tuple(name.strip() for name in text.split(",") if name.strip())
    if not found:
        raise argparse.ArgumentTypeError(f"'{text}' names nothing")
    return found


def box(text: str) -> NDArray[np.float64]:
    """Six numbers between commas: a (2, 3) box."""
    try:
        corners = np.array([float(part) for part in text.split(",")]).reshape(2, 3)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not six numbers X,Y,Z,X,Y,Z") from None
    return corners


class StoreUnless(argparse.Action):
    """Stores a value, unless one of other arguments, whose default is None, was given.

    Args:
        unless: the others' names in the namespace.
        reason: why not both, as the end of a sentence.
    """

    def __init__(self, *args: Any, unless: Sequence[str], reason: str, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._unless, self._reason = unless, reason

    def __call__(
        self,
        parser: argparse.ArgumentParser,  # noqa: ARG002
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,  # noqa: ARG002
    ) -> None:
        for other in self._unless:
            if getattr(namespace, other, None) is not None:
                option = f"--{other.replace('_', '-')}"
                raise argparse.ArgumentError(self, f"not together with {option}: {self._reason}")
        setattr(namespace, self.dest, values)
