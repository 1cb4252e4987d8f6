# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether two descriptions of a thing are equal, arrays in them too."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

import numpy as np


def is_same(a: object, b: object) -> bool:
    """Whether two values are equal: numbers, texts, arrays, and tuples and dataclasses of such.

    Dataclasses are compared field by field, as their own == cannot compare arrays.
    """
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if is_dataclass(a):
        return all(is_same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, np.ndarray):
        return np.array_equal(a, np.asarray(b))
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(is_same(x, y) for x, y in zip(a, b, strict=True))
    return bool(a == b)
