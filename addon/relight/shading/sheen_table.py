# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape of Cycles' microfiber sheen, as `tools/measure_sheen.py` measured it."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_PATH = Path(__file__).with_suffix(".npy")


@cache
def sheen_table() -> NDArray[np.float32]:
    """(32, 32, 4) float32, by roughness (rows) and the view's cosine (columns), nodes on 0 and 1
    of both: albedo R, then a and b of the transformed cosine, and 0."""
    measured = np.load(_PATH)
    return np.concatenate([measured, np.zeros_like(measured[..., :1])], axis=-1)
