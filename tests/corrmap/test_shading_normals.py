# SPDX-License-Identifier: GPL-3.0-or-later
"""Normals that come from the mesh and not from texels, on the GPU beside their twin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.plan import ChannelPlan
from addon.scene.geometry import SceneGeometry
from addon.scene.octahedral import to_codes
from tests import synthetic
from tests.corrmap.test_correspondence import STORED, Setup, channel_of, make_setup, pixel_centres
from tests.reference.shading_normal import shading_normals

# A place's error (`test_visible_extremes`: 16 spacings of its distance, here up to 5) over a
# triangle's height (1 or more) is one of the corners' shares, by which normals change that are up
# to 2 apart; normalizing what may be half as long doubles it.
ROUNDING = 16 * 2.0**-24 * 5.0 * 2.0 * 2.0
# Rasterizers have corners at multiples of this of a pixel.
SNAP = 1.0 / 256.0


def bent(geometry: SceneGeometry) -> SceneGeometry:
    """With corner normals that lean away from the faces by up to 50 degrees."""
    rng = np.random.default_rng(4)
    lean = rng.uniform(-0.7, 0.7, (len(geometry), 3, 3))
    return replace(geometry, corner_normals=to_codes(geometry.normal[:, None] + lean))


@pytest.fixture(scope="module")
def setup() -> Setup:
    made = make_setup(size=(64, 48))
    return replace(made, geometry=bent(made.geometry))


def twin(
    setup: Setup, shift: tuple[float, float] = (0.0, 0.0)
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """(N,) triangles, (N, 3) normals on the viewer's side, `shift` pixels beside the centres."""
    origins, rays = setup.view.rays(pixel_centres(setup.view) + shift)
    triangle, point = synthetic.Tracer(setup.geometry).hit(origins, rays)
    away = (setup.geometry.normal[triangle] * rays).sum(axis=1) > 0.0
    normal = shading_normals(setup.geometry, triangle, point)
    return triangle, np.where(away[:, None], -normal, normal)


def sure(setup: Setup) -> NDArray[np.bool_]:
    """(N,) pixels whose neighbourhood sees one triangle."""
    triangle, _ = twin(setup)
    inside = np.ones(len(triangle), dtype=bool)
    for shift in ((SNAP, 0.0), (-SNAP, 0.0), (0.0, SNAP), (0.0, -SNAP)):
        inside &= twin(setup, shift)[0] == triangle
    return inside


def test_the_mesh_gives_its_normal_at_each_place(gpu_context: None, setup: Setup) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.shading_normals import ShadingNormalPass
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    buffer = GeometryBuffer(setup.geometry, setup.view.origin)
    visible = VisibleSurfacePass(buffer).draw(setup.view)
    drawn = read_texture(ShadingNormalPass(buffer).draw(visible))
    inside = sure(setup)
    assert inside.mean() > 0.98
    error = np.linalg.norm(drawn.reshape(-1, 4)[:, :3] - twin(setup)[1], axis=1)
    assert error[inside].max() < ROUNDING


def test_flat_meshes_have_no_table(gpu_context: None, setup: Setup) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer

    flat = replace(setup.geometry, corner_normals=None)
    assert GeometryBuffer(flat, setup.view.origin).corner_normals is None


@pytest.mark.parametrize("smooth", [True, False])
def test_materials_without_bumps_have_the_mesh_normal(
    gpu_context: None, setup: Setup, smooth: bool
) -> None:
    """Also where no camera saw them. Of others it is the texels', where there are any."""
    from addon.corrmap.surface_sampler import SurfaceSampler
    from addon.glsl.shader import read_texture

    geometry = setup.geometry if smooth else replace(setup.geometry, corner_normals=None)
    geometry = replace(geometry, material_names=("one", "two"))
    view = setup.view
    values = {}
    for name, flags in {"texels": (), "mesh": (False, True)}.items():
        of_mesh = {"normal": flags} if flags else {}
        plan = ChannelPlan(STORED, {}, ("one", "two"), mesh_normals=of_mesh)
        # Few of the cameras, so that some of what is seen is a hole.
        sampler = SurfaceSampler(geometry, setup.framebuffers[:3], plan)
        sampler.set_view(view)
        surface = sampler.sample(0)
        material = read_texture(surface.position).reshape(-1, 4)[:, 3]
        origin = read_texture(surface.geometric_normal).reshape(-1, 4)
        values[name] = channel_of(surface, "normal")
    mesh = material == 2.0
    read = ~mesh & (origin[:, 3] > 0.0)
    assert np.array_equal(values["texels"][read], values["mesh"][read])
    assert mesh.sum() > 100
    assert (origin[mesh, 3] == 0.0).any()
    if not smooth:
        assert np.array_equal(values["mesh"][mesh], origin[mesh, :3])
        return
    chosen = mesh & sure(setup)
    error = np.linalg.norm(values["mesh"] - twin(setup)[1], axis=1)
    assert error[chosen].max() < ROUNDING
    assert np.median(np.linalg.norm(values["texels"] - values["mesh"], axis=1)[chosen]) > 0.05


def test_shading_samples_have_it_where_they_are_shaded(gpu_context: None, setup: Setup) -> None:
    from addon.corrmap.surface_sampler import SurfaceSampler
    from addon.glsl.shader import read_texture

    geometry = replace(setup.geometry, material_names=("one", "two"))
    plan = ChannelPlan(STORED, {}, ("one", "two"), mesh_normals={"normal": (False, True)})
    sampler = SurfaceSampler(geometry, setup.framebuffers, plan)
    sampler.set_view(setup.view)
    while sampler.find_shading_samples(8):
        pass
    for k in (0, 5):
        surface = sampler.shading_sample(k)
        position = read_texture(surface.position).reshape(-1, 4).astype(np.float64)
        facing = read_texture(surface.geometric_normal).reshape(-1, 4)[:, :3]
        mesh = position[:, 3] == 2.0
        eye = np.broadcast_to(setup.view.origin, (int(mesh.sum()), 3))
        triangle, point = synthetic.Tracer(geometry).hit(eye, position[mesh, :3])
        place = position[mesh, :3] + setup.view.origin
        side = (geometry.normal[triangle] * facing[mesh]).sum(axis=1)
        # Not beyond an edge, where the rasterizer saw another one.
        one = (np.linalg.norm(point - place, axis=1) < 1e-5) & (np.abs(side) > 0.999)
        assert one.mean() > 0.9
        assert one.sum() > 100
        expected = shading_normals(geometry, triangle, place) * np.sign(side)[:, None]
        found = channel_of(surface, "normal")[mesh]
        assert np.linalg.norm(found - expected, axis=1)[one].max() < ROUNDING


def test_normals_come_with_what_rays_see(gpu_context: None, setup: Setup) -> None:
    """The pass that finds what is seen gives the same normals, and the same turns of them, as those
    that ask for them afterwards."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.local_scene import LocalScene
    from addon.corrmap.normal_bend import NormalBendPass
    from addon.corrmap.shading_normals import ShadingNormalPass
    from addon.corrmap.traced_triangles import TrianglesByRay
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    geometry, view = setup.geometry, setup.view
    buffer, scene = GeometryBuffer(geometry, view.origin), LocalScene(geometry, view.origin)
    scene.mesh(geometry.camera_visible)
    by_ray = TrianglesByRay(buffer, scene, 0, software=True)
    seen = VisibleSurfacePass(buffer).draw_traced(
        view, (0.0, 0.0), by_ray, normals=True, bends=True
    )
    assert seen is not None
    assert seen.shading_normal is not None
    assert seen.bend is not None
    alone = replace(seen, shading_normal=None, bend=None)
    normals, bends = ShadingNormalPass(buffer), NormalBendPass(buffer)
    assert normals.draw(seen) is seen.shading_normal
    assert bends.of(seen).texture(1) is seen.bend
    found, given = read_texture(normals.draw(alone)), read_texture(seen.shading_normal)
    assert found[..., :3].any()
    # Two programs may round in another order.
    np.testing.assert_allclose(given, found, atol=1e-5)
    found, given = read_texture(bends.of(alone).texture(1)), read_texture(seen.bend)
    assert found.any()
    # The direction of what varies most may be told by either sign.
    lengths = [np.linalg.norm(values[..., :3], axis=-1) for values in (found, given)]
    np.testing.assert_allclose(lengths[1], lengths[0], rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(given[..., 3], found[..., 3], rtol=1e-2, atol=1e-4)
