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
    if evaluated.is_evaluated and not _is_disabled(depsgraph, evaluated.original):
        return np.array(evaluated.matrix_world, dtype=np.float64)
    own = np.array(obj.matrix_basis, dtype=np.float64)
    if obj.parent is None:
        return own
    inverse = np.array(obj.matrix_parent_inverse, dtype=np.float64)
    return np.asarray(world_from_object(depsgraph, obj.parent) @ inverse @ own)


def _is_disabled(depsgraph: Any, obj: Any) -> bool:
    """Whether an object is in a graph, because others refer to it, but not kept up to date."""
    flag = "hide_viewport" if depsgraph.mode == "VIEWPORT" else "hide_render"
    return any(getattr(each, flag) for each in (obj, *obj.users_collection))
