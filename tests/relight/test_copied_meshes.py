# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a scene whose repeated meshes are on the GPU once, beside the same flattened."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.relight.shadows.shadow_frustum import ShadowSettings
from addon.scene.geometry import SceneGeometry
from addon.scene.light import Light
from tests import copied_meshes, synthetic
from tests.relight.test_session import make_store, point_light

VIEW = synthetic.perspective_view(
    synthetic.looking_at((-1.5, -1.6, 0.9), (0.3, 0.2, -0.6)), 64, 48, 1.2
)


def picture(
    geometry: SceneGeometry, store: Any, light: Light, method: str, visibility: int
) -> NDArray[np.float32]:
    from addon.relight.session import RelightSession

    settings = ShadowSettings(method=cast("Any", method))
    session = RelightSession(
        geometry, cast("Any", store), 4, shadows=settings, visibility=visibility
    )
    session.set_world(None)
    session.set_lights([light])
    session.set_view(VIEW)
    # From so far that local space is made anew, and back.
    far = VIEW.world_from_camera.copy()
    far[:3, 3] += 1e4
    session.set_view(replace(VIEW, world_from_camera=far))
    session.set_view(VIEW)
    copies = session._sampler.geometry_buffer.copies
    assert (copies is None) == (not geometry.copies)
    return np.asarray(session.render().combined)


@pytest.mark.parametrize("visibility", [0, 16])
@pytest.mark.parametrize("method", ["map", "traced"])
def test_as_if_flattened(gpu_context: None, visibility: int, method: str) -> None:
    """All but pixels at outlines, where a corner's rounding decides."""
    places = copied_meshes.places(4, 1.2)
    mesh = copied_meshes.tree()
    geometry = copied_meshes.with_copies(mesh, places, synthetic.room_with_box())
    store = make_store(geometry, synthetic.cube_cameras((-1.2, -1.0, 1.0), 96))
    light = replace(point_light("Key", (-1.0, -1.2, 1.5)), shadow_soft_size=0.1)
    one = picture(geometry, store, light, method, visibility)
    other = picture(replace(geometry, copies=()), store, light, method, visibility)
    assert other[..., :3].max() > 0.01
    error = np.abs(one - other).max(axis=2)
    assert (error > 1e-4 * other.max()).mean() < 0.01
    alone = picture(synthetic.room_with_box(), store, light, method, 0)
    assert (np.abs(one - alone).max(axis=2) > 1e-3 * other.max()).mean() > 0.2
