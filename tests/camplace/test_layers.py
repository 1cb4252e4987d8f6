# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through many layers of foliage, each of them cut away where the ray passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.camplace.rays import RayCaster
from addon.scene.geometry import Cutout
from tests.synthetic import geometry_of

SHEET = np.array([[0, 1, 2], [0, 2, 3]])
SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


def _above_a_floor(layers: int) -> RayCaster:
    """Sheets at z = 1, 2, ... whose left halves are cut away, and a whole one at z = 0."""
    sheets = [(np.add(SQUARE, (0, 0, layer)), SHEET) for layer in range(layers + 1)]
    geometry = geometry_of(sheets)
    uv = SQUARE[:, :2].astype(np.float32)[np.tile(SHEET, (layers + 1, 1))]
    alpha = np.array([[0.0, 1.0]], dtype=np.float32)
    cutouts = tuple(Cutout(layer, alpha, "EXTEND") for layer in range(1, layers + 1))
    return RayCaster(replace(geometry, uv=uv, cutouts=cutouts))


@pytest.mark.parametrize("layers", [1, 2, 5, 7])
def test_a_ray_passes_several_cut_away_layers(layers: int) -> None:
    rays = _above_a_floor(layers)
    start = np.array([[0.2, 0.4, layers + 0.5], [0.8, 0.4, layers + 0.5]])
    down = np.tile([0.0, 0.0, -1.0], (2, 1))
    # The floor on the left, the uppermost sheet on the right. Float32 rays that begin anew a
    # little below each layer.
    np.testing.assert_allclose(rays.first_hit(start, down).distance, [layers + 0.5, 0.5], rtol=1e-4)
    end = start - [0.0, 0.0, layers + 0.25]
    assert rays.occluded(start, end).tolist() == [False, True]
    assert rays.occluded(end, start).tolist() == [False, True]


def test_a_ray_does_not_go_on_without_end() -> None:
    rays = _above_a_floor(30)
    start = np.array([[0.2, 0.4, 30.5]])
    assert rays.occluded(start, start - [0.0, 0.0, 30.25]).all()
