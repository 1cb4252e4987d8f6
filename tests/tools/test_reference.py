# SPDX-License-Identifier: GPL-3.0-or-later
"""The Cycles reference against values known on paper."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from addon.progress import silent
from tools.metrics import encode_srgb
from tools.reference import Reference, light_groups, prepare, render_reference

POWER, HEIGHT, ALBEDO = 80.0, 2.0, 0.5
SIZE = (24, 18)
# Cycles' filter is a table, 0.01 pixel wide here: 0.05 % of the falloff, and float32 beside.
RTOL = 1e-3


def add_light(name: str, kind: Any, energy: float, at: tuple[float, float, float]) -> Any:
    data: Any = bpy.data.lights.new(name, kind)
    data.energy = energy
    if kind != "SUN":
        data.shadow_soft_size = 0.0
    light = bpy.data.objects.new(name, data)
    light.location = at
    bpy.context.scene.collection.objects.link(light)
    return light


def add_plane(name: str, size: float, height: float) -> Any:
    corners = [(-size, -size, height), (size, -size, height), (size, size, height), (-size, size, height)]  # fmt: skip  # noqa: E501
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    plane = bpy.data.objects.new(name, mesh)
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (ALBEDO, ALBEDO, ALBEDO, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs[0])
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(plane)
    return plane


@pytest.fixture
def scene() -> Any:
    """A Lambert plane seen from 3 m above, with a point light and a sun."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    add_plane("Ground", 5.0, 0.0)
    add_light("Bulb", "POINT", POWER, (0.0, 0.0, HEIGHT))
    add_light("Sun", "SUN", 2.0, (0.0, 0.0, 5.0))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 3.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    # At the pixels' centres, without the noise of their places.
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "GAUSSIAN", 0.01
    return scene


def expected(scene: Any, *, bulb: bool, sun: bool) -> np.ndarray:
    """(H, W) radiance at the pixel centres: Phi rho cos / (4 pi² d²), and E rho / pi."""
    pixel = 2.0 * np.tan(scene.camera.data.angle_x / 2) / SIZE[0]
    x = (np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) * pixel * 3.0
    y = (np.arange(SIZE[1]) + 0.5 - SIZE[1] / 2) * pixel * 3.0
    squared = HEIGHT**2 + x[None, :] ** 2 + y[:, None] ** 2
    point = POWER * ALBEDO / (4 * np.pi**2) * HEIGHT / squared**1.5
    return bulb * point + sun * 2.0 * ALBEDO / np.pi


def render(scene: Any, **words: Any) -> Reference:
    return render_reference(scene, scene.camera, 16, silent, **words)


def test_lambert_plane_under_a_point_light_and_a_sun(scene: Any) -> None:
    prepare(scene)
    found = render(scene)
    # The pixel's filter bends the falloff by less than 0.1 % here; Cycles' floats far less.
    np.testing.assert_allclose(found.rgba[..., 0], expected(scene, bulb=True, sun=True), rtol=RTOL)
    np.testing.assert_allclose(found.depth, 3.0, rtol=1e-6)
    assert np.unique(found.objects).size == 1
    assert found.perspective
    assert found.pixel == pytest.approx(2 * np.tan(scene.camera.data.angle_x / 2) / SIZE[0])
    assert set(found.layers) == {("Bulb",), ("Sun",)}


def test_depth_is_along_the_view_axis_at_the_pixel_centres(scene: Any) -> None:
    tilt = 0.5
    scene.camera.rotation_euler = (tilt, 0.0, 0.0)
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 1.5
    prepare(scene)
    found = render(scene)
    y = (np.arange(SIZE[1]) + 0.5 - SIZE[1] / 2) * found.pixel
    depth = 3.0 / (np.cos(tilt) - y * np.sin(tilt))
    wanted = np.broadcast_to(depth[:, None], found.depth.shape)
    # The filter for the guides is 0.01 pixel wide, which is 0.02 % of the depth at this tilt.
    np.testing.assert_allclose(found.depth, wanted, rtol=4e-4)


def test_after_an_edit_only_the_edited_light_is_rendered(scene: Any) -> None:
    prepare(scene)
    before = render(scene)
    bpy.data.lights["Bulb"].energy = 3.0 * POWER
    bpy.data.lights["Sun"].energy = 900.0  # not said to have changed, so it must not show
    after = render(scene, known=before, changed=["Bulb"])
    np.testing.assert_allclose(
        after.rgba[..., 0] - before.rgba[..., 0],
        2.0 * expected(scene, bulb=True, sun=False),
        rtol=2 * RTOL,  # two renders
    )
    assert after.layers["Sun",] is before.layers["Sun",]


def test_a_hidden_light_stays_dark_and_the_scene_is_put_back(scene: Any) -> None:
    bpy.data.objects["Sun"].hide_render = True
    prepare(scene)
    world = scene.world
    found = render(scene)
    np.testing.assert_allclose(found.rgba[..., 0], expected(scene, bulb=True, sun=False), rtol=RTOL)
    assert bpy.data.objects["Sun"].hide_render
    assert not bpy.data.objects["Bulb"].hide_render
    assert scene.world == world


def glow(plane: Any, strength: float) -> None:
    tree = plane.data.materials[0].node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = strength
    output = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs[0], output.inputs[0])


def test_what_glows_adds_no_noise_to_the_lights(scene: Any) -> None:
    """Their layers are the same to the bit, in a second view too."""
    scene.objects["Bulb"].data.shadow_soft_size = 0.5
    lamp, dark = add_plane("Lamp", 0.3, 4.0), add_plane("Dark", 0.3, 5.0)
    glow(lamp, 0.0)
    prepare(scene)
    alone = render(scene).layers
    glow(dark, 7.0)
    prepare(scene)
    for _ in range(2):
        beside = render(scene)
        assert beside.base[0][..., :3].max() > 1e-3
        for name, halves in alone.items():
            assert np.array_equal(beside.layers[name], halves), name
    assert not np.array_equal(*alone["Bulb",])  # It is noisy.


def test_what_glows_is_seen_once_and_lights_once(scene: Any) -> None:
    panel = add_plane("Panel", 0.3, 1.0)
    glow(panel, 7.0)
    panel.visible_shadow = False
    prepare(scene)
    found = render(scene)
    centre = found.rgba[SIZE[1] // 2, SIZE[0] // 2, 0]
    assert centre == pytest.approx(7.0, rel=1e-5)
    # Radiance times cosines over the squared distance, summed over the panel.
    cells = (np.arange(60) + 0.5) / 60.0 * 0.6 - 0.3
    u, v = np.meshgrid(cells, cells)
    pixel = 3.0 * 2.0 * np.tan(scene.camera.data.angle_x / 2) / SIZE[0]
    x = (np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) * pixel
    y = (0.5 - SIZE[1] / 2) * pixel
    squared = 1.0 + (u - x[:, None, None]) ** 2 + (v - y) ** 2
    from_panel = ALBEDO / np.pi * 7.0 * (1.0 / squared**2).mean(axis=(1, 2)) * 0.36
    wanted = expected(scene, bulb=True, sun=True)[0] + from_panel
    # 16 samples of the panel, of which 24 pixels' mean is looked at.
    assert found.rgba[0, :, 0].mean() == pytest.approx(wanted.mean(), rel=0.01)
    for halves in found.layers.values():
        assert halves[0][0].max() < expected(scene, bulb=True, sun=True).max()


def test_the_worlds_light_is_counted_once(scene: Any) -> None:
    world = bpy.data.worlds.new("World")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.3, 0.3, 0.3, 1.0)
    scene.world = world
    prepare(scene)
    found = render(scene)
    # An open Lambert plane under a constant sky of radiance L sends back albedo times L.
    wanted = expected(scene, bulb=True, sun=True) + ALBEDO * 0.3
    np.testing.assert_allclose(found.rgba[..., 0].mean(), wanted.mean(), rtol=1e-2)  # sky noise


def test_many_lights_are_grouped(scene: Any) -> None:
    for number in range(19):
        add_light(f"Lamp {number}", "POINT", 1.0, (0.0, 0.0, 1.0))
    groups = light_groups()
    assert len(groups) == 8
    assert sorted(name for group in groups for name in group) == sorted(
        obj.name for obj in scene.objects if obj.type == "LIGHT"
    )


def test_the_noise_floor_is_the_means_own_error() -> None:
    random = np.random.default_rng(0)
    truth = np.full((128, 128, 4), 0.5, dtype=np.float32)
    halves = [truth + random.normal(0, 0.01, truth.shape).astype(np.float32) for _ in range(2)]
    flat = np.ones((128, 128), dtype=np.float32)
    found = Reference((halves[0], halves[1]), {}, flat, flat, 0.01, perspective=True)
    # sRGB's slope at 0.5: 1.055 / 2.4 * 0.5^(1 / 2.4 - 1); the mean's noise is 0.01 / sqrt(2).
    deviation = 255 * 1.055 / 2.4 * 0.5 ** (1 / 2.4 - 1) * 0.01 / np.sqrt(2)
    wanted = 20 * np.log10(255 / deviation)
    # 49152 differences: their variance is known to 0.6 %, 0.03 dB
    assert found.noise_floor()["psnr_rgb"] == pytest.approx(wanted, abs=0.1)


def test_the_noise_of_a_reference_is_no_part_of_the_noiseless_error() -> None:
    random = np.random.default_rng(0)
    truth = np.full((128, 128, 4), 0.5, dtype=np.float32)
    halves = [truth + random.normal(0, 0.01, truth.shape).astype(np.float32) for _ in range(2)]
    flat = np.ones((128, 128), dtype=np.float32)
    found = Reference((halves[0], halves[1]), {}, flat, flat, 0.01, perspective=True)
    # A picture one and a half levels too bright in its left half, and right elsewhere.
    image = truth[..., :3].copy()
    level = 255.0 * 1.055 / 2.4 * 0.5 ** (1 / 2.4 - 1)
    image[:, :64] += 1.5 / level
    off = np.rint(255.0 * encode_srgb(image)) - 255.0 * encode_srgb(truth[..., :3])
    right = np.zeros((128, 128), dtype=bool)
    right[:, 64:] = True
    for mask, wanted in (
        (~right, off[0, 0, 0] ** 2),
        (None, (off[0, 0, 0] ** 2 + off[0, 127, 0] ** 2) / 2),
    ):
        found_error = 255.0**2 * 10 ** (-(found.noiseless_psnr(image, mask) or 0.0) / 10)
        # Products of noise of 1.8 levels' luma, 8192 of them: 1.4 % of a squared level and more
        # where they meet the error, 5 % of it in all.
        assert found_error == pytest.approx(wanted, rel=0.2)
    noisy = 255.0 * encode_srgb(found.rgba[..., :3])
    assert np.mean((np.rint(255 * encode_srgb(image)) - noisy) ** 2) > 2.0 * wanted


def test_joined_references_have_half_the_noise(scene: Any) -> None:
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 1.5
    prepare(scene)
    first, second = render(scene), render(scene, first_seed=100)
    joined = first.joined(second)
    np.testing.assert_allclose(joined.rgba, 0.5 * (first.rgba + second.rgba), rtol=1e-6)
    floors = [part.noise_floor()["psnr_rgb"] or 0.0 for part in (joined, first, second)]
    # Half the variance is 3.0 dB; 432 pixels tell a floor to about half a decibel.
    assert floors[0] - np.mean(floors[1:]) == pytest.approx(3.0, abs=1.5)
