# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheer layers in plain numpy, float64: what each lets through, and what is seen of a stack."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from addon.scene.geometry import Sheer

from .cutout import mask_alpha


def transmission(sheer: Sheer, uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) at (N, 2) texture coordinates."""
    inside = np.stack(
        [mask_alpha(sheer.transmission[..., c], uv, sheer.extension) for c in range(3)], axis=-1
    )
    if sheer.extension != "CLIP":
        return inside
    whole = np.ones(sheer.transmission.shape[:2], dtype=np.float32)
    there = mask_alpha(whole, uv, "CLIP")[:, None]
    return inside + (1.0 - there) * sheer.outside


def shares(through: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Of layers, nearest first, and of what is behind them the share that reaches the viewer."""
    result = [np.ones_like(through[0])]
    for each in through:
        result.append(result[-1] * each)
    return result
