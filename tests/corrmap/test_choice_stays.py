# SPDX-License-Identifier: GPL-3.0-or-later
"""Which texel a point of a surface reads does not depend on who looks at it, or from where.

So seams between caching cameras lie still on the surfaces while the view moves, without any memory
of earlier views.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests import synthetic
from tests.corrmap.test_correspondence import STORED, Setup, make_setup


@pytest.fixture(scope="module")
def setup() -> Setup:
    return make_setup(size=(96, 64))


def test_the_choice_is_one_of_the_point_alone(gpu_context: None, setup: Setup) -> None:
    """Points in another order, so with other neighbours in other tiles, find the same."""
    from addon.caching.plan import ChannelPlan
    from addon.corrmap.correspondence import CorrespondencePass
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.tile_pages import upload_tiles
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture, texture_from_array

    # Another view of the room, but in the local space of the first.
    origin = setup.view.origin
    pages = upload_tiles(setup.framebuffers, ChannelPlan(STORED, {}, ("one", "two")), drop=False)
    visible_pass = VisibleSurfacePass(GeometryBuffer(setup.geometry, origin))
    search = CorrespondencePass(pages, origin)
    rng = np.random.default_rng(7)
    for eye in (origin, origin + np.array([0.4, 0.3, -0.5])):
        target = setup.offset + setup.scale * np.array([0.3, 0.2, -0.6])
        view = replace(setup.view, world_from_camera=synthetic.looking_at(eye, target))
        visible = visible_pass.draw(view)
        found = search.draw(visible).read().reshape(-1, 4)
        order = rng.permutation(len(found))
        position, normal = (
            read_texture(t).reshape(-1, 4)[order].reshape(view.height, view.width, 4)
            for t in (visible.position, visible.normal)
        )
        shuffled = replace(
            visible,
            position=texture_from_array(position, "RGBA32F"),
            normal=texture_from_array(normal, "RGBA32F"),
        )
        again = search.draw(shuffled).read().reshape(-1, 4)
        assert len(np.unique(found[:, 0])) > 4
        assert np.array_equal(again, found[order])
