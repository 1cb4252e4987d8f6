# SPDX-License-Identifier: GPL-3.0-or-later
"""What no caching camera sees of a sheer layer is a hole, though what lies behind it is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from addon.caching.bake import BakeSettings, bake_scene
from addon.caching.store import CacheStore
from addon.caching.temporary_store import TemporaryStore
from addon.camplace.hole_cameras import hole_cameras
from addon.hole_bake import bake_holes
from addon.progress import silent
from addon.relight.session import RelightSession
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.view_reader import read_view
from tests.relight.test_sheer_against_cycles import PANES, SIZE, build, caching_cameras

pytestmark = pytest.mark.usefixtures("gpu_context")


def test_layers_have_holes_and_are_filled(tmp_path: Path) -> None:
    scene = build(PANES["alpha 0.3"][0])
    geometry, view = with_render_depsgraph(
        scene, lambda d: (read_geometry(d), read_view(d, scene.camera))
    )
    # The view's own camera, but all pictures leave out the depth of the pane.
    first = caching_cameras(scene, 160)[0]
    cameras = [replace(first, near=5.6), replace(first, id=1, far=4.4)]
    bake_scene(scene, geometry, cameras, tmp_path, BakeSettings(preset="draft"))
    session = RelightSession(geometry, CacheStore.open(tmp_path), 1)
    session.set_view(view)
    points = session.hole_points()
    # The pane stands upright at y = 0; the floor comes no higher than z = 0.
    on_pane = (np.abs(points.seen[:, 1]) < 1e-4) & (points.seen[:, 2] > 0.1)
    share = on_pane.sum() / SIZE**2
    assert share > 0.03
    assert points.is_hole[on_pane].all()
    assert session.coverage.hole_fraction >= share
    found = hole_cameras(view, points)
    numbers = bake_holes(scene, geometry, CacheStore.open(tmp_path), found.cameras, silent)
    pictures = TemporaryStore(CacheStore.open(tmp_path)).read()
    session.set_added([each for each in pictures if each.camera.id in numbers])
    # What is left are pixels at the pane's edges, which their neighbours fill.
    assert session.hole_points().is_hole[on_pane].mean() < 0.03
    assert session.coverage.hole_fraction < 5e-3
    assert session.coverage.open_fraction == 0.0
