# SPDX-License-Identifier: GPL-3.0-or-later
"""Which cubes are looked at, and which is taken."""

from __future__ import annotations

import numpy as np
import pytest

from addon.camplace import choose
from addon.camplace.choose import choose_cameras
from addon.camplace.prepare import Stage, prepare
from addon.camplace.settings import PlacementSettings
from addon.camplace.spheres import Spheres
from addon.progress import silent
from tests.synthetic import looking_at, perspective_view, room_with_box

SETTINGS = PlacementSettings(
    primaries=1, secondaries=0, view_samples=600, area_samples=400, candidates=4
)
# The first is outside, the second in the box; the third sees most of the room.
CENTRES = np.array([[0.0, 0.0, 9.0], [0.3, 0.2, -0.6], [1.2, -1.2, 1.2]])
NOWHERE = Spheres(np.zeros((0, 3)), np.zeros(0))


@pytest.fixture(scope="module")
def stage() -> Stage:
    view = perspective_view(looking_at((1.6, -1.7, 0.9), (-0.4, 0.9, -0.6)), 320, 240, 1.2)
    return prepare(room_with_box(), (view,), None, SETTINGS, np.random.default_rng(0))


@pytest.mark.parametrize("found", [0, 1, 2, 3])
def test_only_cubes_that_see_the_most_are_looked_at(
    stage: Stage, monkeypatch: pytest.MonkeyPatch, found: int
) -> None:
    monkeypatch.setattr(choose, "CUBES", 1)
    spheres, near = (Spheres(part, np.ones(len(part))) for part in np.split(CENTRES, [found]))
    chosen = choose_cameras(
        stage, spheres, near, SETTINGS, lambda _worth: np.zeros((0, 3)), progress=silent
    )
    (cube,) = chosen.groups
    assert all(choice.camera.kind == "CUBE_FACE" for choice in cube)
    np.testing.assert_array_equal(cube[0].camera.origin, CENTRES[2])
    # Its source counts the maximal spheres first, then those near the views.
    assert {choice.camera.source for choice in cube} == {2}


def test_of_the_largest_spheres_only_as_many_as_there_are_candidates(stage: Stage) -> None:
    spheres = Spheres(np.concatenate([np.repeat(CENTRES[:1], 4, axis=0), CENTRES[2:]]), np.ones(5))
    chosen = choose_cameras(
        stage, spheres, NOWHERE, SETTINGS, lambda _worth: np.zeros((0, 3)), progress=silent
    )
    assert chosen.groups == ()
