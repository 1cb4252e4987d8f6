# SPDX-License-Identifier: GPL-3.0-or-later
"""Places that lie in another triangle's plane, of triangles that are known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.local_scene import LocalScene
from addon.relight.shadows.receivers import Receivers
from addon.relight.shadows.shadow_rays import ShadowRays
from addon.scene.geometry import Cutout
from tests.synthetic import geometry_of

from .test_shadow import square

FLOOR, PLATE = [0, 1], [2, 3]


def scene_of(*parts: Any, **changes: Any) -> LocalScene:
    return LocalScene(replace(geometry_of(parts), **changes), np.array([0.3, -0.2, 5.0]))


def on_floor(scene: LocalScene, count: int, half: float) -> Receivers:
    """Places on a floor's first triangle at z = 0, within `half` of its middle."""
    rng = np.random.default_rng(0)
    place = np.stack([*rng.uniform(-half, half, (2, count)), np.zeros(count)])
    place[0], place[1] = np.maximum(place[0], place[1]), np.minimum(place[0], place[1])
    return Receivers(
        place - scene.origin[:, None],
        np.tile(np.array([[0], [0], [1]], dtype=np.float32), count),
        np.full(count, 1e-6, dtype=np.float32),
        np.zeros(count, dtype=np.int32),
    )


def buried(
    scene: LocalScene, receivers: Receivers, casters: list[int] | None = None
) -> NDArray[np.bool_]:
    stops = None if casters is None else np.isin(np.arange(len(scene.geometry)), casters)
    number = np.arange(len(receivers.triangle))[::-1]
    return ShadowRays(scene, stops).buried.of(receivers, number)[::-1]


@pytest.mark.parametrize("casters", [FLOOR, PLATE, FLOOR + PLATE, []])
def test_the_other_triangle_has_to_cast_shadows(casters: list[int]) -> None:
    scene = scene_of(square(2.0, 0.0), square(0.4, 0.0))
    receivers = on_floor(scene, 5000, 1.0)
    x, y, _ = receivers.place + scene.origin[:, None]
    # Not on the plate's diagonal, where neither half of it holds a place.
    inside = (np.abs(x) < 0.4) & (np.abs(y) < 0.4)
    clear = np.abs(x - y) > 1e-5
    found = buried(scene, receivers, casters)
    assert np.array_equal(found[clear], inside[clear] & (PLATE[0] in casters))
    # Of places on the plate it is the floor.
    on_plate = replace(receivers, triangle=np.full(5000, PLATE[0], dtype=np.int32))
    assert np.array_equal(buried(scene, on_plate, casters)[clear & inside],
                          np.full((clear & inside).sum(), FLOOR[0] in casters))  # fmt: skip


def test_triangles_that_are_not_known_are_left_out() -> None:
    scene = scene_of(square(2.0, 0.0), square(0.4, 0.0))
    receivers = on_floor(scene, 100, 0.2)
    assert buried(scene, receivers).all()
    unknown = replace(receivers, triangle=np.full(100, -1, dtype=np.int32))
    assert not buried(scene, unknown).any()


def test_cut_out_plates_bury_nothing() -> None:
    half = Cutout(1, np.array([[0.0, 1.0]], dtype=np.float32), "REPEAT")
    uv = np.zeros((4, 3, 2), dtype=np.float32)
    uv[:, 1, 0] = 1.0
    scene = scene_of(square(2.0, 0.0), square(0.4, 0.0), cutouts=(half,), uv=uv,
                     material_id=np.array([0, 0, 1, 1], dtype=np.int32))  # fmt: skip
    assert not buried(scene, on_floor(scene, 100, 0.2)).any()


def test_many_feet_on_one_floor() -> None:
    """Each triangle of the floor has 20,000 others in its plane."""
    count = 100
    xs = (np.arange(count) + 0.5) / count * 2.0 - 1.0
    feet = [square(0.004, 0.0, (x, y)) for x in xs for y in xs]
    scene = scene_of(square(1.0, 0.0), *feet)
    receivers = on_floor(scene, 20000, 1.0)
    x, y, _ = receivers.place + scene.origin[:, None]
    off = [np.abs((along + 1.0) * count / 2.0 % 1.0 - 0.5) * 2.0 / count for along in (x, y)]
    inside = np.maximum(*off)
    found = buried(scene, receivers)
    sure = np.abs(inside - 0.004) > 1e-6
    # But on diagonals.
    different = (found != (inside < 0.004))[sure]
    assert different.mean() < 1e-3
    assert found.mean() == pytest.approx(0.16, abs=0.02)
