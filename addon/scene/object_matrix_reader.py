# SPDX-License-Identifier: GPL-3.0-or-later
"""Where an object stands, also one that no view layer shows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def world_from_object(depsgraph: Any, obj: Any) -> NDArray[np.float64]:
    """(4, 4) float64.

    What is hidden or excluded in a dependency graph is not evaluated, and its `matrix_world` is
    of some earlier time, or the identity. It is then taken from its own transform and those of
    its parents, without constraints.
    """
    evaluated = obj.evaluated_get(depsgraph)
    if evaluated.is_evaluated:
        return np.array(evaluated.matrix_world, dtype=np.float64)
    own = np.array(obj.matrix_basis, dtype=np.float64)
    if obj.parent is None:
        return own
    inverse = np.array(obj.matrix_parent_inverse, dtype=np.float64)
    return np.asarray(world_from_object(depsgraph, obj.parent) @ inverse @ own)
