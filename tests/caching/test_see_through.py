# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that light passes straight through: the bake cuts away what the view does not draw, and
whatever is not shown as it is has a line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from addon.caching.specialize import specialized
from addon.scene.cutout_reader import read_cutout_source
from addon.scene.geometry_reader import read_geometry
from addon.scene.world_reader import world_warnings

Build = Callable[[Any], Any]


def node(tree: Any, kind: str, **inputs: Any) -> Any:
    made = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        made.inputs[name.replace("_", " ")].default_value = value
    return made


def mixed(tree: Any, factor: Any, first: Any, second: Any) -> Any:
    mix = tree.nodes.new("ShaderNodeMixShader")
    if isinstance(factor, float):
        mix.inputs[0].default_value = factor
    else:
        tree.links.new(factor, mix.inputs[0])
    for number, shader in ((1, first), (2, second)):
        tree.links.new(shader.outputs[0], mix.inputs[number])
    return mix


def pane(factor: str, output: str, **inputs: Any) -> Build:
    """A window: clear from the front, a mirror from the side."""

    def build(tree: Any) -> Any:
        curve = node(tree, factor, **inputs).outputs[output]
        return mixed(tree, curve, node(tree, "BsdfTransparent"), node(tree, "BsdfGlossy"))

    return build


def half(color: tuple[float, ...], factor: float) -> Build:
    return lambda tree: mixed(
        tree, factor, node(tree, "BsdfDiffuse"), node(tree, "BsdfTransparent", Color=color)
    )


WHITE = (1.0, 1.0, 1.0, 1.0)
RED = (1.0, 0.2, 0.1, 1.0)
BLACK = (0.0, 0.0, 0.0, 1.0)


def added(tree: Any) -> Any:
    """What glows and hides nothing."""
    both = tree.nodes.new("ShaderNodeAddShader")
    for number, kind in enumerate(("BsdfTransparent", "Emission")):
        tree.links.new(node(tree, kind).outputs[0], both.inputs[number])
    return both


# What builds a material, what passes straight through (None where all or nothing does, and it is
# cut away or opaque), whether it is cut away, and whether a line says that it is shown otherwise.
MATERIALS: dict[str, tuple[Build, tuple[float, ...] | None, bool, bool]] = {
    "clear": (lambda tree: node(tree, "BsdfTransparent", Color=WHITE), None, True, False),
    "tinted": (lambda tree: node(tree, "BsdfTransparent", Color=RED), RED[:3], False, False),
    "black": (lambda tree: node(tree, "BsdfTransparent", Color=BLACK), None, False, False),
    "alpha 0.3": (lambda tree: node(tree, "BsdfPrincipled", Alpha=0.3), (0.7,) * 3, False, False),
    "alpha 0.7": (lambda tree: node(tree, "BsdfPrincipled", Alpha=0.7), (0.3,) * 3, False, False),
    "half": (half(WHITE, 0.5), (0.5,) * 3, False, False),
    "more than half": (half(WHITE, 0.6), (0.6,) * 3, False, False),
    "tinted half": (half(RED, 0.6), (0.6, 0.12, 0.06), False, False),
    "added": (added, (1.0,) * 3, False, False),
    "pane by Fresnel": (pane("Fresnel", "Factor", IOR=1.45), (0.9663,) * 3, False, True),
    "pane by Layer Weight": (pane("LayerWeight", "Fresnel", Blend=0.3), (0.9689,) * 3, False, True),
    "pane by facing": (pane("LayerWeight", "Facing", Blend=0.3), (1.0,) * 3, False, True),
    "mirror": (pane("Fresnel", "Factor", IOR=20.0), (0.1814,) * 3, False, True),
    "glass": (lambda tree: node(tree, "BsdfGlass"), None, False, True),
}


def add_material(name: str) -> Any:
    """A material with nothing but an output, on a plane of its own."""
    material = bpy.data.materials.new(name)
    for each in list(material.node_tree.nodes):
        material.node_tree.nodes.remove(each)
    material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))
    return material


def output_of(material: Any) -> Any:
    return material.node_tree.get_output_node("ALL")


@pytest.fixture
def scene() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def is_cut(material: Any) -> bool:
    """Whether the view draws nothing of it."""
    source = read_cutout_source(material)
    return source is not None and bool((source.alpha < 0.5).all())


def test_the_view_and_the_bake_agree(scene: Any) -> None:
    for name, (build, _, _, _) in MATERIALS.items():
        material = add_material(name)
        shader = build(material.node_tree)
        material.node_tree.links.new(shader.outputs[0], output_of(material).inputs["Surface"])
    geometry = read_geometry(bpy.context.evaluated_depsgraph_get())
    with specialized(tuple(MATERIALS), 0) as (plan, baked):
        transparency = {each.name: each.lobes.transparency for each in baked}
        is_sheer = {each.name: each.is_sheer for each in baked}
        said = {str(item) for item in plan.approximations} | set(geometry.warnings)
    sheers = {geometry.material_names[each.material_id]: each for each in geometry.sheers}
    for name, (_, through, cut, named) in MATERIALS.items():
        value = float(np.mean(getattr(transparency[name], "values", (0.0,))))
        assert is_sheer[name] == (name in sheers) == (through is not None), name
        if through is not None:
            assert sheers[name].transmission == pytest.approx(
                np.array(through)[None, None], abs=1e-4
            )
            assert value == pytest.approx(np.mean(through), abs=1e-4), name
        else:
            assert (value > 0.5) == cut, (name, value)
        assert is_cut(bpy.data.materials[name]) == cut, name
        assert any(f"'{name}'" in line for line in said) == named, (name, said)


def test_a_volume_has_no_surface(scene: Any) -> None:
    """Fog in a box hides nothing; with a surface about it, it is that surface."""
    for name in ("fog", "jelly"):
        material = add_material(name)
        tree, output = material.node_tree, output_of(material)
        volume = node(tree, "VolumeScatter")
        tree.links.new(volume.outputs[0], output.inputs["Volume"])
        if name == "jelly":
            surface = node(tree, "BsdfDiffuse")
            tree.links.new(surface.outputs[0], output.inputs["Surface"])
        assert is_cut(material) == (name == "fog")
    with specialized(("fog", "jelly"), 0) as (plan, baked):
        assert [each.is_cut_out for each in baked] == [True, False]
        said = {item.material: item.effect for item in plan.approximations}
    assert "volume" in said["fog"]
    assert "volume" in said["jelly"]


def test_the_worlds_volume_is_named_however_black_it_is(scene: Any) -> None:
    world = scene.world = bpy.data.worlds.new("Fog")
    graph = bpy.context.evaluated_depsgraph_get()
    assert world_warnings(graph) == ()
    tree = world.node_tree
    output = tree.get_output_node("ALL")
    tree.nodes.remove(next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground"))
    tree.links.new(node(tree, "VolumeScatter").outputs[0], output.inputs["Volume"])
    bpy.context.view_layer.update()
    (said,) = world_warnings(bpy.context.evaluated_depsgraph_get())
    assert "'Fog'" in said
    assert "volume" in said


@pytest.mark.parametrize("has_world", [False, True])
def test_the_films_exposure_is_named(scene: Any, has_world: bool) -> None:
    scene.world = bpy.data.worlds.new("Sky") if has_world else None
    assert world_warnings(bpy.context.evaluated_depsgraph_get()) == ()
    scene.cycles.film_exposure = 2.5
    (said,) = world_warnings(bpy.context.evaluated_depsgraph_get())
    assert "film exposure of 2.5" in said
