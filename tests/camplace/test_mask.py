# SPDX-License-Identifier: GPL-3.0-or-later
"""Cut-outs: which triangles need no look at their mask, and where points are drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.camplace.area_samples import sample_area
from addon.camplace.mask import EXTENSIONS, Mask
from addon.scene.geometry import Cutout, SceneGeometry
from tests.synthetic import geometry_of

SHEET = np.array([[0, 1, 2], [0, 2, 3]])
SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


def _leaves(extension: str, count: int = 3000) -> SceneGeometry:
    """Triangles whose uv are small and anywhere, over a mask of a few blots; some have none."""
    rng = np.random.default_rng(5)
    vertices = rng.random((3 * count, 3))
    geometry = geometry_of([(vertices, np.arange(3 * count).reshape(-1, 3))])
    alpha = np.zeros((24, 40), dtype=np.float32)
    alpha[4:20, 3:14] = alpha[:9, 22:] = 1.0
    middle = rng.uniform(-0.5, 1.5, (count, 1, 2))
    uv = (middle + rng.normal(size=(count, 3, 2)) * 0.06).astype(np.float32)
    return replace(
        geometry,
        material_id=(np.arange(count) % 5 == 0).astype(np.int32),
        uv=uv,
        cutouts=(Cutout(0, alpha, extension),),  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_triangles_said_to_be_uniform_are(extension: str) -> None:
    geometry = _leaves(extension)
    mask = Mask(geometry)
    there, away = mask.uniform
    assert not (there & away).any()
    assert not (there | away)[geometry.material_id == 1].any()
    # The mask is at least a quarter there and a quarter not: many triangles lie within either.
    assert there.sum() > 5
    assert away.sum() > 5
    rng = np.random.default_rng(6)
    for chosen, answer in ((there, True), (away, False)):
        triangle = np.repeat(np.flatnonzero(chosen), 200)
        weights = rng.dirichlet(np.ones(3), len(triangle))
        weights[:3] = np.eye(3)
        assert (mask.opaque_at(triangle, weights[:, 1:]) == answer).all()


def test_no_point_is_drawn_where_a_cutout_is_cut_away() -> None:
    """The left half of one sheet is cut away; the other has no mask."""
    geometry = geometry_of([(SQUARE, SHEET), (np.add(SQUARE, (0, 0, 1)), SHEET)])
    corner = SQUARE[:, :2].astype(np.float32)
    cutout = Cutout(0, np.array([[0.0, 1.0]], dtype=np.float32), "EXTEND")
    geometry = replace(geometry, uv=corner[np.tile(SHEET, (2, 1))], cutouts=(cutout,))
    bounds = geometry.bounds + np.array([[-1.0], [1.0]])
    point, triangle = sample_area(geometry, np.ones(4), bounds, 3000, np.random.default_rng(7))
    masked = triangle < 2
    assert len(point) == 3000
    assert (point[masked, 0] >= 0.5 - 1e-12).all()
    # A third of what is left; the draw is systematic, so it is off by little.
    assert masked.mean() == pytest.approx(1 / 3, abs=0.02)
    assert (point[~masked, 0] < 0.5).any()
