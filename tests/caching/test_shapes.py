# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked normals, depths and occlusion of shapes whose answer is known on paper."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import pytest

from .material_grid import (
    HALF,
    RESOLUTION,
    add_plane,
    bake,
    camera_above,
    empty_material,
    empty_scene,
    node_in,
)


def grey(name: str = "grey") -> bpy.types.Material:
    material, surface = empty_material(name)
    node = node_in(material.node_tree, "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5))
    material.node_tree.links.new(node.outputs[0], surface)
    return material


def texel_centres() -> np.ndarray:
    """(R, R, 2) u and v, row 0 at the bottom."""
    centre = (np.arange(RESOLUTION) + 0.5) / RESOLUTION
    return np.stack(np.meshgrid(centre, centre), axis=-1)


def test_normals_and_depths_of_a_sphere(tmp_path: Path) -> None:
    """Far from the world's origin, where a wrong texel centre or a lost digit would show."""
    scene = empty_scene()
    center = np.array([100.0, -50.0, 20.0])
    bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, location=center)
    ball = bpy.context.object
    ball.data.shade_smooth()
    ball.data.materials.append(grey())
    add_plane(scene, "far away", (0.0, 0.0, -40.0), grey("other"))
    camera = camera_above(tuple(center), 4.0, fov=0.6)
    store, _ = bake(scene, [camera], tmp_path)
    framebuffer = store.read_camera(0)
    depth = framebuffer.channels["depth"].astype(np.float64)
    hit = depth[..., 0] > 0.0
    assert 0.5 < hit.mean() < 0.9
    points = camera.unproject(np.concatenate([texel_centres(), depth], axis=-1))[hit]
    radius = np.linalg.norm(points - center, axis=1)
    # A chord of the mesh lies up to (pi / 128)^2 / 8 inside the sphere; seen at a slant, as at
    # the rim, depth moves by more, so the rim is left out.
    normal = (points - center) / radius[:, None]
    front = normal[:, 2] > 0.5
    assert np.abs(radius - 1.0)[front].max() < (np.pi / 128) ** 2
    found = framebuffer.channels["normal"][hit]
    # Interpolated over a facet, a normal is off by no more than the chord is; then half's bits.
    assert np.abs(found - normal)[front].max() < (np.pi / 128) ** 2 + 2 * HALF
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0, atol=2 * HALF)


@pytest.mark.parametrize("case", ["plain", "beside cut-outs", "without a material"])
def test_occlusion_beside_a_long_wall(tmp_path: Path, case: str) -> None:
    """At distance d from an endless wall of height H, (1 - d / sqrt(d^2 + H^2)) / 2 is hidden.

    With a cut-out anywhere, occlusion is the light of a white sky, apart from other lights; for
    surfaces without a material, rays are traced."""
    scene = empty_scene()
    if case == "beside cut-outs":
        material, surface = empty_material("veil")
        node = node_in(material.node_tree, "ShaderNodeBsdfPrincipled", Alpha=0.25)
        material.node_tree.links.new(node.outputs[0], surface)
        add_plane(scene, "veil", (1.5, 0.0, -1.0), material, size=0.1)
        sun = bpy.data.lights.new("Sun", "SUN")
        sun.energy = 100.0
        scene.collection.objects.link(bpy.data.objects.new("Sun", sun))
    scene.world = bpy.data.worlds.new("Sky")
    material = None if case == "without a material" else grey()
    add_plane(scene, "floor", (0.0, 0.0, 0.0), material, size=200.0)
    wall = add_plane(scene, "wall", (0.0, 0.0, 0.0), material, size=2.0)
    # Upright in the plane x = 0, a thousand times as long as it is high (half under the floor).
    wall.rotation_euler = (0.0, np.pi / 2, 0.0)
    wall.scale = (1.0, 1000.0, 1.0)
    camera = camera_above((1.5, 0.0, 0.0), 4.0, fov=0.5)
    store, _ = bake(scene, [camera], tmp_path, preset="final")
    framebuffer = store.read_camera(0)
    depth = framebuffer.channels["depth"].astype(np.float64)
    points = camera.unproject(np.concatenate([texel_centres(), depth], axis=-1))
    distance = points[..., 0]
    expected = 1.0 - 0.5 * (1.0 - distance / np.sqrt(distance**2 + 1.0))
    found = framebuffer.channels["ambient_occlusion"][..., 0]
    # 64 texels of 32 rays in a column: standard error 0.5 / sqrt(2048) = 0.011; 4 of them.
    error = (found - expected).mean(axis=0)
    assert np.abs(error).max() < 0.045
    assert abs(error.mean()) < 0.006


def test_a_camera_that_sees_nothing_without_a_material(tmp_path: Path) -> None:
    """Another camera does; both planes lie in the open.

    No texel's centre is on a plane's diagonal, where Cycles' rays hit the other triangle."""
    scene = empty_scene()
    scene.world = bpy.data.worlds.new("Sky")
    add_plane(scene, "grey", (0.0, 0.0, 0.0), grey())
    add_plane(scene, "bare", (20.0, 0.0, 0.0), None)
    cameras = [camera_above((20.0 * i, 0.03, 0.0), 4.0, fov=0.2, number=i) for i in range(2)]
    store, _ = bake(scene, cameras, tmp_path, preset="final")
    for number in range(2):
        occlusion = store.read_camera(number).channels["ambient_occlusion"]
        assert np.all(occlusion == 1.0)


def test_occlusion_by_leaves_with_holes(tmp_path: Path) -> None:
    """Under a wide screen that covers everything, the floor is open where the screen is."""
    scene = empty_scene()
    scene.world = bpy.data.worlds.new("Sky")
    add_plane(scene, "floor", (0.0, 0.0, 0.0), grey(), size=4.0)
    material, surface = empty_material("leaves")
    tree = material.node_tree
    waves = tree.nodes.new("ShaderNodeTexChecker")
    waves.inputs["Scale"].default_value = 40.0
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], waves.inputs[0])
    node = node_in(tree, "ShaderNodeBsdfPrincipled", Alpha=waves.outputs["Fac"])
    tree.links.new(node.outputs[0], surface)
    add_plane(scene, "screen", (0.0, 0.0, 3.0), material, size=400.0)
    camera = camera_above((0.0, 0.0, 0.0), 2.0, fov=1.0)
    store, _ = bake(scene, [camera], tmp_path, preset="final")
    found = store.read_camera(0).channels["ambient_occlusion"]
    # Half of the screen is holes; 4096 texels of 32 rays.
    assert abs(found.mean() - 0.5) < 0.02
