# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights and worlds as read from Blender."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from addon.scene.light import Light
from addon.scene.world import World


@pytest.fixture
def scene() -> Iterator[Any]:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield bpy.context.scene
    bpy.ops.wm.read_factory_settings(use_empty=True)


def add(scene: Any, name: str, kind: str, **settings: Any) -> Any:
    import bpy

    data: Any = bpy.data.lights.new(name, kind)
    obj: Any = bpy.data.objects.new(name, data)
    scene.collection.objects.link(obj)
    for key, value in settings.items():
        setattr(data, key, value)
    return obj


def read(scene: Any) -> dict[str, Light]:
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.light_reader import read_lights

    return {light.name: light for light in with_render_depsgraph(scene, read_lights)}


def world_of(scene: Any) -> World | None:
    from addon.scene.depsgraph_reader import with_render_depsgraph
    from addon.scene.world_reader import read_world

    return with_render_depsgraph(scene, read_world)


def test_every_attribute(scene: Any) -> None:
    add(scene, "P", "POINT", energy=5.0, shadow_soft_size=0.25, use_soft_falloff=False)
    add(scene, "S", "SPOT", spot_size=1.0, spot_blend=0.5, exposure=2.0, use_shadow=False)
    add(scene, "U", "SUN", energy=3.0, angle=0.1, normalize=False)
    area = add(scene, "A", "AREA", shape="ELLIPSE", size=2.0, size_y=3.0, spread=1.0)
    area.location, area.scale = (1, 2, 3), (1, 2, -1)
    area.visible_glossy = False
    lights = read(scene)
    p, s, u, a = (lights[name] for name in "PSUA")
    assert (p.type, p.energy, p.shadow_soft_size, p.use_soft_falloff) == ("POINT", 5.0, 0.25, False)
    assert (s.spot_size, s.spot_blend, s.exposure, s.use_shadow) == (1.0, 0.5, 2.0, False)
    assert u.angle == pytest.approx(0.1)
    assert (u.energy, u.normalize) == (3.0, False)
    assert (a.shape, a.size, a.size_y, a.spread) == ("ELLIPSE", 2.0, 3.0, 1.0)
    assert (a.diffuse_factor, a.specular_factor) == (1.0, 0.0)
    np.testing.assert_array_equal(a.position, (1, 2, 3))
    np.testing.assert_allclose(a.world_from_light[:3, :3], np.diag([1, 2, -1]))
    np.testing.assert_allclose(a.direction, (0, 0, 1))
    assert all(not light.warnings for light in lights.values())
    assert p.spread == s.spread == np.pi


def test_hidden_black_and_portal_lights_are_left_out(scene: Any) -> None:
    import bpy

    add(scene, "Hidden", "POINT").hide_render = True
    add(scene, "Black", "POINT", energy=0.0)
    add(scene, "Flat", "AREA").scale = (1, 0, 1)
    add(scene, "Portal", "AREA").data.cycles.is_portal = True
    add(scene, "Only viewport", "POINT").hide_viewport = True
    collection = bpy.data.collections.new("Hidden")
    scene.collection.children.link(collection)
    collection.hide_render = True
    inside = add(scene, "In a hidden collection", "POINT")
    scene.collection.objects.unlink(inside)
    collection.objects.link(inside)
    assert set(read(scene)) == {"Only viewport"}


def test_temperature_and_nodes(scene: Any) -> None:
    warm = add(scene, "Warm", "POINT", use_temperature=True, temperature=3000.0)
    warm.data.color = (1.0, 0.5, 1.0)
    nodes = add(scene, "Nodes", "POINT")
    emission = nodes.data.node_tree.nodes["Emission"]
    emission.inputs["Strength"].default_value = 3.0
    emission.inputs["Color"].default_value = (1.0, 0.5, 0.25, 1.0)
    strange = add(scene, "Strange", "POINT")
    tree = strange.data.node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs[0], tree.nodes["Emission"].inputs["Strength"])
    off = add(scene, "Off", "POINT")
    off.data.node_tree.links.clear()
    lights = read(scene)
    # A black body's colour at 3000 K as Blender has it.
    np.testing.assert_allclose(
        lights["Warm"].color, np.array(warm.data.temperature_color) * (1.0, 0.5, 1.0)
    )
    assert lights["Warm"].color[0] > 1.0 > lights["Warm"].color[2]
    np.testing.assert_allclose(lights["Nodes"].color, (3.0, 1.5, 0.75))
    np.testing.assert_allclose(lights["Strange"].color, 1.0)
    assert "'Strange'" in lights["Strange"].warnings[0]
    assert "Off" not in lights


@pytest.mark.parametrize("color", [(float("inf"), 1.0, 1.0), (1.0, float("nan"), 1.0)])
def test_a_light_without_a_finite_power_gives_none_and_says_so(scene: Any, color: Any) -> None:
    lamp = add(scene, "Broken", "POINT")
    lamp.data.color = color
    add(scene, "Whole", "POINT")
    lights = read(scene)
    assert not lights["Broken"].is_lit
    assert any("beyond all measure" in warning for warning in lights["Broken"].warnings)
    assert lights["Whole"].is_lit
    assert lights["Whole"].warnings == ()


def test_instances_have_names_of_their_own(scene: Any) -> None:
    import bpy

    collection = bpy.data.collections.new("Fixture")
    lamp = add(scene, "Lamp", "POINT")
    scene.collection.objects.unlink(lamp)
    collection.objects.link(lamp)
    for name, x in (("Left", -1.0), ("Right", 1.0)):
        empty: Any = bpy.data.objects.new(name, None)
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        empty.location = (x, 0.0, 0.0)
        scene.collection.objects.link(empty)
    lights = read(scene)
    assert {name: light.position[0] for name, light in lights.items()} == {
        "Left/Lamp": -1.0,
        "Right/Lamp": 1.0,
    }


def test_what_is_not_modelled_is_said(scene: Any) -> None:
    add(scene, "Narrow", "AREA", spread=0.0)
    add(scene, "Seen", "POINT").visible_camera = True
    lights = read(scene)
    assert "spread" in lights["Narrow"].warnings[0]
    assert lights["Narrow"].spread == pytest.approx(np.radians(1.0))
    assert "cameras" in lights["Seen"].warnings[0]


def test_worlds(scene: Any) -> None:
    import bpy

    assert world_of(scene) is None
    scene.world = bpy.data.worlds.new("World")
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.5, 0.25, 1.0, 1.0)
    background.inputs["Strength"].default_value = 2.0
    scene.render.film_transparent = True
    scene.world.cycles_visibility.glossy = False
    world = world_of(scene)
    assert world is not None
    assert world.radiance is not None
    np.testing.assert_allclose(world.radiance, (1.0, 0.5, 2.0))
    assert world.film_transparent
    assert (world.camera_visible, world.diffuse_visible, world.glossy_visible) == (
        True,
        True,
        False,
    )
    assert not world.needs_baking
    background.inputs["Strength"].default_value = 0.0
    scene.render.film_transparent = False
    assert world_of(scene) is None
    background.inputs["Strength"].default_value = 1.0
    sky = scene.world.node_tree.nodes.new("ShaderNodeTexSky")
    scene.world.node_tree.links.new(sky.outputs[0], background.inputs["Color"])
    world = world_of(scene)
    assert world is not None
    assert world.needs_baking


def test_picture_of_a_world(scene: Any) -> None:
    """A world that shows its direction as its colour."""
    import bpy

    from addon.relight.world.equirect import directions
    from addon.scene.world_reader import render_world

    scene.world = bpy.data.worlds.new("World")
    tree: Any = scene.world.node_tree
    place = tree.nodes.new("ShaderNodeTexCoord")
    shift = tree.nodes.new("ShaderNodeVectorMath")
    shift.operation = "MULTIPLY_ADD"
    shift.inputs[1].default_value = shift.inputs[2].default_value = (0.5, 0.5, 0.5)
    tree.links.new(place.outputs["Generated"], shift.inputs[0])
    tree.links.new(shift.outputs[0], tree.nodes["Background"].inputs["Color"])
    before = {name: len(getattr(bpy.data, name)) for name in ("scenes", "objects", "cameras")}
    picture = render_world(scene, 32)
    want = 0.5 + 0.5 * directions(32, 64)
    # Four samples scattered in a texel of a tenth of a radian, whose colour's slope is half.
    np.testing.assert_allclose(picture, want, atol=0.05)
    np.testing.assert_allclose(picture.mean(axis=1), want.mean(axis=1), atol=0.01)
    assert {name: len(getattr(bpy.data, name)) for name in before} == before


def test_a_black_world_is_read_for_a_transparent_film(scene: Any) -> None:
    import bpy

    for black in (None, bpy.data.worlds.new("Black")):
        if black is not None:
            black.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
        scene.world = black
        scene.render.film_transparent = False
        assert world_of(scene) is None
        scene.render.film_transparent = True
        world = world_of(scene)
        assert world is not None
        assert world.is_black
        assert world.film_transparent
