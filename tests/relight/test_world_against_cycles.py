# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's light against Cycles: a metal and a matte ball on a glossy floor under an HDRI with
a sun, baked, relit and rendered."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bmesh
import bpy
import numpy as np
import pytest
from mathutils import Matrix
from numpy.typing import NDArray
from scipy import ndimage

from addon.caching.bake import bake_scene
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera
from addon.relight.world.equirect import directions
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.view_reader import read_view
from addon.scene.world_reader import read_world

from .test_against_cycles import cycles_picture

WIDTH, HEIGHT = 80, 60
ROWS = 128


def _principled(name: str, **inputs: Any) -> Any:
    made: Any = bpy.data.materials.new(name)
    made.node_tree.nodes.clear()
    node = made.node_tree.nodes.new("ShaderNodeBsdfPrincipled")
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    output = made.node_tree.nodes.new("ShaderNodeOutputMaterial")
    made.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    return made


def _build() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=8)
    floor = _principled("Floor", Base_Color=(0.6, 0.5, 0.4, 1.0), Roughness=0.4)
    bpy.context.object.data.materials.append(floor)
    metal = _principled("Metal", Base_Color=(0.9, 0.7, 0.3, 1.0), Metallic=1.0, Roughness=0.3)
    matte = _principled("Matte", Base_Color=(0.2, 0.4, 0.8, 1.0), Roughness=0.8)
    for x, material in ((-0.8, metal), (0.8, matte)):
        bpy.ops.mesh.primitive_uv_sphere_add(
            segments=64, ring_count=32, radius=0.7, location=(x, 0.0, 0.8)
        )
        ball: Any = bpy.context.object
        ball.data.shade_smooth()
        ball.data.materials.append(material)
    toward = directions(ROWS, 2 * ROWS)
    pixels = np.ones((ROWS, 2 * ROWS, 4), dtype=np.float32)
    up = toward[..., 2:]
    pixels[..., :3] = np.where(up > 0.0, np.array([0.3, 0.5, 0.9]) * (0.4 + 0.6 * up), 0.1)
    sun = np.array([0.5, -0.6, 0.7])
    near = toward @ (sun / np.linalg.norm(sun)) > np.cos(np.radians(2.0))
    pixels[near, :3] += np.array([600.0, 500.0, 400.0], dtype=np.float32)
    image: Any = bpy.data.images.new("Sky", 2 * ROWS, ROWS, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    scene.world = bpy.data.worlds.new("World")
    tree: Any = scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    tree.links.new(node.outputs[0], tree.nodes["Background"].inputs["Color"])
    camera: Any = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -5.0, 2.6), (np.radians(68.0), 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    return scene


def _relit_and_cycles(
    scene: Any, tmp_path: Path, samples: tuple[int, int]
) -> tuple[Any, Any, NDArray[np.float64]]:
    """A session, its picture, and Cycles', of so many samples."""
    from addon.relight.session import RelightSession
    from addon.relight.shadows.shadow_frustum import ShadowSettings

    geometry, view, world = with_render_depsgraph(
        scene, lambda d: (read_geometry(d), read_view(d, scene.camera), read_world(d))
    )
    fov = 2.0 * np.arctan(18.0 / 50.0) * 1.02
    caching = CachingCamera(
        0, view.world_from_camera.copy(), float(fov), 0.5, 50.0, 512, "PERSPECTIVE", 0
    )
    bake_scene(scene, geometry, [caching], tmp_path / "cache")
    session = RelightSession(geometry, CacheStore.open(tmp_path / "cache"), samples[0])
    session.set_shadows(ShadowSettings(method="traced"))
    session.set_world(world)
    session.set_view(view)
    picture = session.render()
    return session, picture, cycles_picture(scene, tmp_path / "cycles.exr", samples[1])[..., :3]


def test_still_life(gpu_context: None, tmp_path: Path) -> None:
    from addon.glsl.shader import read_texture

    session, picture, cycles = _relit_and_cycles(_build(), tmp_path, (32, 512))
    relit = picture.layers["World"].astype(np.float64)
    camera = picture.correspondence[..., 0]
    seen = session._sampler.sample(0)
    position = read_texture(seen.position)[..., 3]
    edge = ndimage.maximum_filter(position, 5) != ndimage.minimum_filter(position, 5)
    inside = (position > 0.0) & (camera >= 0.0) & ~edge
    assert inside.mean() > 0.4
    assert np.isfinite(relit).all()
    assert relit[inside].mean() == pytest.approx(cycles[inside].mean(), rel=0.01)
    error = ((relit - cycles)[inside] / cycles[inside].max()) ** 2
    assert -10.0 * np.log10(error.mean()) > 45.0
    for number in np.unique(position[inside]):
        mine = inside & (position == number)
        assert relit[mine].mean() == pytest.approx(cycles[mine].mean(), rel=0.015)


def test_what_lies_in_the_floor_is_black(gpu_context: None, tmp_path: Path) -> None:
    """Of the floor's mesh, so that both are one surface."""
    scene = _build()
    made = bmesh.new()
    floor: Any = bpy.data.objects["Plane"].data
    made.from_mesh(floor)
    for x in (-1.4, 1.5):
        bmesh.ops.create_grid(made, size=0.5, matrix=Matrix.Translation((x, -1.3, 0.0)))
    made.to_mesh(floor)
    made.free()
    _, picture, cycles = _relit_and_cycles(scene, tmp_path, (4, 16))
    relit = picture.layers["World"].astype(np.float64)
    black = ndimage.binary_erosion(cycles.max(axis=-1) < 1e-3 * cycles.max())
    assert black.sum() > 100
    assert relit[black].max() < 1e-3 * cycles.max()
