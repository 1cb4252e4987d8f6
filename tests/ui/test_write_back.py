# SPDX-License-Identifier: GPL-3.0-or-later
"""Controls in a light's node tree: put in once, and taken out without a trace."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.errors import InputError
from addon.scene.light_controls import (
    BarnDoors,
    DistanceRange,
    Falloff,
    LightControls,
    Slide,
    Superellipse,
)
from addon.scene.written_light import is_written_node

DOORS = LightControls(barn_doors=BarnDoors(Superellipse(0.4, 0.3)))


@pytest.fixture
def light() -> Iterator[Any]:
    """An object with a light."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    obj: Any = bpy.data.objects.new("Key", bpy.data.lights.new("Key", "POINT"))
    bpy.context.scene.collection.objects.link(obj)
    yield obj
    bpy.ops.wm.read_factory_settings(use_empty=True)


def dump(obj: Any) -> dict[str, Any]:
    """All that an artist could see of a light, its nodes and what the file holds."""
    import bpy

    tree = obj.data.node_tree
    return {
        "nodes": [(n.name, n.bl_idname, tuple(n.location), n.mute, n.select) for n in tree.nodes],
        "values": [
            (n.name, s.identifier, _plain(s.default_value))
            for n in tree.nodes
            for s in n.inputs
            if hasattr(s, "default_value")
        ],
        "links": sorted(
            (x.from_node.name, x.from_socket.identifier, x.to_node.name, x.to_socket.identifier)
            for x in tree.links
        ),
        "animated": tree.animation_data is not None,
        "visible": (obj.visible_diffuse, obj.visible_glossy),
        "marks": list(obj.keys()),
        "files": (len(bpy.data.node_groups), len(bpy.data.images)),
    }


def _plain(value: Any) -> Any:
    return tuple(value) if hasattr(value, "__len__") else value


def written_nodes(obj: Any) -> list[Any]:
    return [n for n in obj.data.node_tree.nodes if is_written_node(n)]


def test_what_was_written_is_removed_without_a_trace(light: Any) -> None:
    from addon.ui import write_back

    before = dump(light)
    slide = Slide(np.ones((4, 4, 4), dtype=np.float32), "Window", blur=0.1)
    controls = LightControls(
        barn_doors=DOORS.barn_doors,
        distance=DistanceRange(near=1.0, far=3.0),
        falloff=Falloff(1.0),
        slide=slide,
        diffuse=0.0,
    )
    write_back.write(light.data, controls)
    assert dump(light) != before
    assert not light.visible_diffuse
    write_back.remove(light.data)
    assert dump(light) == before


def test_writing_again_replaces_what_was_written(light: Any) -> None:
    import bpy

    from addon.ui import write_back

    for width in (0.1, 0.2):
        doors = LightControls(barn_doors=BarnDoors(Superellipse(width, 0.3)))
        assert not write_back.is_current(light.data, doors)
        write_back.write(light.data, doors)
        assert write_back.is_current(light.data, doors)
    assert len(written_nodes(light)) == len(bpy.data.node_groups) == 1


def test_neutral_controls_leave_the_light_alone(light: Any) -> None:
    from addon.ui import write_back

    before = dump(light)
    write_back.write(light.data, DOORS)
    write_back.write(light.data, LightControls())
    assert dump(light) == before
    assert not write_back.is_written(light.data)


def test_every_emission_that_shines_is_shaped(light: Any) -> None:
    from addon.ui import write_back

    tree = light.data.node_tree
    first, output = tree.nodes["Emission"], tree.nodes["Light Output"]
    second, idle = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeEmission")
    mix, color = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeRGB")
    tree.links.new(color.outputs[0], second.inputs["Color"])
    tree.links.new(first.outputs[0], mix.inputs[1])
    tree.links.new(second.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    before = dump(light)
    write_back.write(light.data, DOORS)
    for emission in (first, second):
        assert is_written_node(emission.inputs["Color"].links[0].from_node)
    assert not idle.inputs["Color"].is_linked
    write_back.remove(light.data)
    assert dump(light) == before


def test_a_colour_that_was_changed_meanwhile_stays(light: Any) -> None:
    from addon.ui import write_back

    write_back.write(light.data, DOORS)
    written_nodes(light)[0].inputs["Color"].default_value = (0.25, 0.5, 1.0, 1.0)
    write_back.remove(light.data)
    color = light.data.node_tree.nodes["Emission"].inputs["Color"].default_value
    assert tuple(color) == (0.25, 0.5, 1.0, 1.0)


def test_an_animated_colour_is_refused(light: Any) -> None:
    from addon.ui import write_back

    color = light.data.node_tree.nodes["Emission"].inputs["Color"]
    color.keyframe_insert("default_value", frame=1)
    before = dump(light)
    with pytest.raises(InputError, match="animate a Color node"):
        write_back.write(light.data, DOORS)
    assert dump(light) == before


def test_a_refused_light_keeps_what_it_has(light: Any) -> None:
    from addon.ui import write_back

    color = light.data.node_tree.nodes["Emission"].inputs["Color"]
    write_back.write(light.data, replace(DOORS, diffuse=0.0))
    color.keyframe_insert("default_value", frame=1)
    before = dump(light)
    with pytest.raises(InputError, match="animate a Color node"):
        write_back.write(light.data, LightControls(falloff=Falloff(1.0)))
    assert dump(light) == before
    assert not light.visible_diffuse
    assert write_back.is_current(light.data, replace(DOORS, diffuse=0.0))
    # What needs no nodes is not in the way of any.
    write_back.write(light.data, LightControls())
    assert not write_back.is_written(light.data)


def test_a_copied_light_keeps_its_own(light: Any) -> None:
    from addon.ui import write_back

    write_back.write(light.data, DOORS)
    copy = light.data.copy()
    write_back.remove(light.data)
    assert not write_back.is_written(light.data)
    assert write_back.is_current(copy, DOORS)
    write_back.remove(copy)


def test_relume_reads_a_written_light_as_it_was(light: Any) -> None:
    from addon.ui import write_back
    from tests.scene.test_light_reader import read

    emission = light.data.node_tree.nodes["Emission"]
    emission.inputs["Color"].default_value = (0.25, 0.5, 1.0, 1.0)
    import bpy

    before = read(bpy.context.scene)["Key"]
    write_back.write(light.data, LightControls(falloff=Falloff(1.0), specular=0.0))
    after = read(bpy.context.scene)["Key"]
    np.testing.assert_array_equal(after.color, before.color)
    assert after.specular_factor == before.specular_factor == 1.0
    assert after.warnings == before.warnings == ()


def test_a_shader_that_hides_its_emission_is_refused(light: Any) -> None:
    import bpy

    from addon.ui import write_back

    tree = light.data.node_tree
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = inner
    tree.links.new(group.outputs[0], tree.nodes["Light Output"].inputs["Surface"])
    before = dump(light)
    with pytest.raises(InputError, match="Emission nodes in the light's own tree"):
        write_back.write(light.data, DOORS)
    assert dump(light) == before


def test_suns_get_no_nodes(light: Any) -> None:
    from addon.ui import write_back

    light.data.type = "SUN"
    before = dump(light)
    write_back.write(light.data, DOORS)
    assert dump(light) == before
