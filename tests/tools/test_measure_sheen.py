# SPDX-License-Identifier: GPL-3.0-or-later
"""The sheen's numbers are found again from the light that they send."""

from __future__ import annotations

import numpy as np

from addon.relight.shading.sheen_table import sheen_table
from tools.measure_sheen import _SUNS, NODES, solve


def test_the_three_numbers_are_found_from_four_suns() -> None:
    random = np.random.default_rng(2)
    R, a, b = (random.uniform(*ends, 1000) for ends in ((0.01, 0.9), (0.05, 1.0), (-0.5, 0.2)))
    seen = []
    for x, y, z in _SUNS:
        size_sq = (a * x + b * z) ** 2 + (a * y) ** 2 + z**2
        seen.append(R * z / np.pi * (a / size_sq) ** 2)
    # Differences of numbers of order one lose a few digits of sixteen.
    np.testing.assert_allclose(solve(*seen), np.stack([R, a, b], axis=-1), rtol=1e-9)


def test_the_table_that_is_shipped_is_a_sheen() -> None:
    table = sheen_table()
    assert table.shape == (NODES, NODES, 4)
    assert np.isfinite(table).all()
    albedo = table[..., 0]
    assert (albedo >= 0.0).all()
    assert (albedo < 1.0).all()
    # It grows toward the outline, and with the roughness where it is looked at straight on.
    assert (np.diff(albedo[8:], axis=1) < 0.0).all()
    assert (np.diff(albedo[8:, -1]) > 0.0).all()
