# SPDX-License-Identifier: GPL-3.0-or-later
"""Any axis gets a right-handed frame, those along the coordinate axes too."""

from __future__ import annotations

import numpy as np
import pytest

from addon.scene.frame_across import frame_across

AXES = [*np.eye(3), *-np.eye(3), *np.random.default_rng(0).normal(size=(20, 3)), np.ones(3)]


@pytest.mark.parametrize("axis", AXES)
def test_it_is_orthonormal_and_right_handed(axis: np.ndarray) -> None:
    axis = axis / np.linalg.norm(axis)
    right, up = frame_across(axis)
    frame = np.stack([right, up, axis])
    # A dozen roundings of numbers up to 1.
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=12 * np.finfo(float).eps)
    np.testing.assert_allclose(np.cross(right, up), axis, atol=12 * np.finfo(float).eps)
