# SPDX-License-Identifier: GPL-3.0-or-later
"""What weights do."""

from __future__ import annotations

import numpy as np
import pytest

from addon.errors import InputError
from tests.synthetic import room_with_box
from tools.weights import with_weights


def test_weights_of_objects_and_materials_multiply() -> None:
    geometry = room_with_box()
    first, second = geometry.object_names[0], geometry.object_names[1]
    found = with_weights(geometry, {first: 0.5})
    expected = np.where(geometry.object_id == 0, 0.25, 1.0)  # object and material share a name
    np.testing.assert_allclose(found.weight, expected)
    with pytest.raises(InputError, match="no object or material 'Absent'"):
        with_weights(geometry, {second: 1.0, "Absent": 1.0})
