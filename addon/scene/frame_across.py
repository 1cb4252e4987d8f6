# SPDX-License-Identifier: GPL-3.0-or-later
"""Two directions across a third."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def frame_across(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, 3) unit vectors right and up, with (right, up, `axis`) right-handed.

    Which turn about the axis they have is arbitrary, and the same for the same axis.

    Args:
        axis: (3,) unit vector.
    """
    # The coordinate axis that lies the least along it is at least 54 degrees away from it.
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    right = np.cross(helper, axis)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(axis, right)])
