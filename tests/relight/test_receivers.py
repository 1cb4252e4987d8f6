# SPDX-License-Identifier: GPL-3.0-or-later
"""Where rays start, by the triangles that the rasterizer numbered, beside float64."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.corrmap.geometry_buffer import GeometryBuffer
from addon.corrmap.local_scene import LocalScene, TrianglePlanes
from addon.corrmap.visible_surface import VisibleSurfacePass
from addon.glsl.shader import read_texture
from addon.relight.shadows.receivers import SeenReceivers, find_triangles
from tests import synthetic
from tests.reference.surfaces import surfaces

UP = np.array([0.0, 0.0, 1.0])
SPACING = 2.0**-24


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e5])
def test_rasterized_triangles(gpu_context: None, scale: float, offset: float) -> None:
    """Starts are on the plane of the triangle that each pixel sees, as a ray through it finds it,
    and lifted by as much as its farthest corner asks for."""
    place = np.array([offset, -offset, offset])
    geometry = synthetic.room_with_box(scale, place)
    eye = np.array([-1.5, -1.2, 1.1]) * scale + place
    view = synthetic.perspective_view(
        synthetic.looking_at(eye, np.array([0.3, 0.2, -0.6]) * scale + place),
        64, 48, 1.2, near=1e-3 * scale, far=1e2 * scale,
    )  # fmt: skip
    # Local space lies elsewhere than the eye: only then does anything round.
    origin = eye + scale * np.array([0.7, -0.4, 0.9])
    drawn = VisibleSurfacePass(GeometryBuffer(geometry, origin)).draw(view)
    buffer = replace(
        surfaces(np.zeros((48, 64, 3)), UP).upload(),
        origin=origin,
        eye=eye - origin,
        position=drawn.position,
        geometric_normal=drawn.normal,
        triangles=drawn.seen_triangles,
    )
    scene = LocalScene(geometry, origin)
    seen = SeenReceivers.of(buffer, scene)
    assert buffer.triangles is not None
    triangle = buffer.triangles.read()[seen.hit]
    assert seen.hit.all()
    assert len(np.unique(triangle)) > 5
    known = seen.receivers
    start, facing = known.place.T, known.normal.T
    rasterized = read_texture(drawn.position)[..., :3].reshape(-1, 3).T
    by_rays = find_triangles(scene, buffer, rasterized, known.normal)
    # But where two meet.
    assert np.mean(by_rays == triangle) > 0.98

    corners = scene.geometry.vertices[scene.geometry.triangles[triangle]]
    exact = scene.geometry.normal_of(triangle)
    cosine = np.sum(exact * facing, axis=1)
    assert np.abs(np.abs(cosine) - 1.0).max() < 4.0 * SPACING
    toward = (eye - origin) - start
    assert (np.sum(facing * toward, axis=1) > 0.0).all()
    reach = np.abs(corners - start[:, None]).max(axis=(1, 2))
    reach = np.maximum(reach, np.abs(start).max(axis=1))
    # The normal's rounding, along each axis, over the way to the corner that its plane goes by.
    above = np.abs(np.einsum("nx,nx->n", start - corners[:, 0], exact))
    assert (above <= 3.0 * SPACING * reach).all()
    assert (known.lift >= 16.0 * SPACING * reach * (1.0 - 4.0 * SPACING)).all()
    # A triangle's edges are at most twice as long as what is seen of it is far from its corners.
    assert (known.lift <= 16.0 * SPACING * 2.0 * reach * (1.0 + 1e-5)).all()


def test_a_triangle_without_a_plane(gpu_context: None) -> None:
    """A pixel's own place and normal serve."""
    vertices = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])
    geometry = synthetic.geometry_of([(vertices, np.array([[0, 1, 2]]))])
    assert not TrianglePlanes.of(geometry).normal.any()
    seen = surfaces(np.array([[[0.5, 0.0, 0.0]]]), UP).upload()
    known = SeenReceivers.of(seen, LocalScene(geometry, np.zeros(3))).receivers
    assert np.array_equal(known.place.T, [[0.5, 0.0, 0.0]])
    assert np.array_equal(known.normal.T, [UP])
