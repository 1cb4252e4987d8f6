# SPDX-License-Identifier: GPL-3.0-or-later
"""Subdividing keeps the surface, its uv and what each triangle had."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.scene.geometry import Cutout, SceneGeometry
from benchmarks.subdivision import subdivided
from tests.synthetic import room_with_box


def _room() -> SceneGeometry:
    """With uv that are an affine map of the place on each triangle."""
    room = room_with_box()
    place = room.vertices[room.triangles]
    uv = np.stack([place[..., 0] + 2.0 * place[..., 1], place[..., 2] - place[..., 0]], axis=-1)
    cutout = Cutout(0, np.ones((2, 2), dtype=np.float32), "REPEAT")
    return replace(room, uv=uv.astype(np.float32), cutouts=(cutout,))


@pytest.mark.parametrize("factor", [1, 2, 4, 7, 16, 29.3])
def test_the_surface_stays(factor: float) -> None:
    room = _room()
    count = int(factor * len(room))
    fine = subdivided(room, count)
    assert len(fine) == count
    assert len(fine.vertices) == len(np.unique(fine.vertices, axis=0))
    # Middles are halves of sums of few bits: rounding alone is left, of float64 and, in uv, 32.
    for number in range(len(room.object_names)):
        mine, was = fine.object_id == number, room.object_id == number
        assert fine.area[mine].sum() == pytest.approx(room.area[was].sum(), rel=1e-12)
        np.testing.assert_allclose(
            fine.area[mine] @ fine.normal[mine], room.area[was] @ room.normal[was], atol=1e-12
        )
    place = fine.vertices[fine.triangles]
    uv = np.stack([place[..., 0] + 2.0 * place[..., 1], place[..., 2] - place[..., 0]], axis=-1)
    assert fine.uv is not None
    np.testing.assert_allclose(fine.uv, uv, atol=1e-6)


def test_fewer_triangles_than_there_are_change_nothing() -> None:
    room = _room()
    assert subdivided(room, 3) is room
