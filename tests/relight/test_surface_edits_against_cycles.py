# SPDX-License-Identifier: GPL-3.0-or-later
"""Edited surfaces against Cycles with the same change of their nodes.

Balls are baked as their nodes are and relit as they are edited; Cycles renders them after their
nodes were changed. As in test_lobes_against_cycles.py, no noise is in either picture.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.bake import bake_scene
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera
from addon.errors import InputError
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.light_reader import read_lights
from addon.scene.surface_edit import SurfaceEdit, SurfaceEdits
from addon.scene.view_reader import read_view
from addon.ui.surface_write_back import apply_edit

from .test_against_cycles import cycles_picture

PIXELS = 60  # of a ball's cell
COLUMNS = 6
WARM = (0.8, 0.5, 0.2)
TINT = (0.3, 0.9, 0.6)
COLORED = SurfaceEdit(gain=0.8, tint=TINT)
PRINCIPLED = "ShaderNodeBsdfPrincipled"
METALLIC = "ShaderNodeBsdfMetallic"
GLOSSY = "ShaderNodeBsdfAnisotropic"

# Makes the shader that a material has before the edit, or after it.
Shader = Callable[[Any], Any]


@dataclass(frozen=True)
class Case:
    """A material as it is baked, its edit, and the nodes that are to look the same."""

    baked: Shader
    edit: SurfaceEdit
    changed: Shader


def _node(kind: str, **inputs: Any) -> Shader:
    def make(tree: Any) -> Any:
        node = tree.nodes.new(kind)
        for key, value in inputs.items():
            if key.startswith("set_"):
                setattr(node, key.removeprefix("set_"), value)
                continue
            socket = node.inputs[key.replace("_", " ")]
            if callable(value):
                tree.links.new(value(tree), socket)
            else:
                socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
        return node.outputs[0]

    return make


def _case(edit: SurfaceEdit, kind: str, inputs: dict[str, Any], changes: dict[str, Any]) -> Case:
    return Case(_node(kind, **inputs), edit, _node(kind, **(inputs | changes)))


def _by(factor: tuple[float, float, float], color: Any = WARM) -> tuple[float, float, float]:
    return tuple(a * b for a, b in zip(color, factor, strict=True))


def _noise(tree: Any) -> Any:
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 3.0
    place = tree.nodes.new("ShaderNodeNewGeometry")
    tree.links.new(place.outputs["Position"], noise.inputs["Vector"])
    return noise.outputs["Color"]


def _noise_by(factor: tuple[float, float, float]) -> Shader:
    def make(tree: Any) -> Any:
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation = "MULTIPLY"
        node.inputs[1].default_value = factor
        tree.links.new(_noise(tree), node.inputs[0])
        return node.outputs[0]

    return make


def _grain(factor: float, offset: float) -> Shader:
    """The noise's grey, as roughness, times a factor and so much more."""

    def make(tree: Any) -> Any:
        node = tree.nodes.new("ShaderNodeMath")
        node.operation, node.use_clamp = "MULTIPLY_ADD", True
        node.inputs[1].default_value, node.inputs[2].default_value = factor, offset
        noise = _noise(tree).node
        tree.links.new(noise.outputs[0], node.inputs[0])
        return node.outputs[0]

    return make


def _mix(color: tuple[float, float, float], gloss: tuple[float, float, float]) -> Shader:
    def make(tree: Any) -> Any:
        mix = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(_node("ShaderNodeFresnel", IOR=1.8)(tree), mix.inputs[0])
        tree.links.new(_node("ShaderNodeBsdfDiffuse", Color=color)(tree), mix.inputs[1])
        tree.links.new(_node(GLOSSY, Color=gloss, Roughness=0.3)(tree), mix.inputs[2])
        return mix.outputs[0]

    return make


def _half(shader: Shader) -> Shader:
    def make(tree: Any) -> Any:
        mix = tree.nodes.new("ShaderNodeMixShader")
        mix.inputs[0].default_value = 0.5
        tree.links.new(shader(tree), mix.inputs[2])
        return mix.outputs[0]

    return make


def _ior(f0: float) -> float:
    return float((1.0 + np.sqrt(f0)) / (1.0 - np.sqrt(f0)))


WARMER = _by(COLORED.color_factor)
COAT_F0 = ((1.8 - 1.0) / (1.8 + 1.0)) ** 2
METAL = {"Base_Color": WARM, "Edge_Tint": (0.2, 0.5, 0.9), "Roughness": 0.4}
ROUGHER = SurfaceEdit(roughness=1.5, roughness_offset=0.05)
CASES: dict[str, Case] = {
    "diffuse": _case(
        COLORED, "ShaderNodeBsdfDiffuse", {"Color": WARM}, {"Color": WARMER}),
    "rough diffuse": _case(
        COLORED, "ShaderNodeBsdfDiffuse", {"Color": WARM, "Roughness": 0.8}, {"Color": WARMER}),
    "translucent": _case(
        COLORED, "ShaderNodeBsdfTranslucent", {"Color": WARM}, {"Color": WARMER}),
    "sheen": _case(
        COLORED, "ShaderNodeBsdfSheen", {"Color": WARM, "Roughness": 0.6}, {"Color": WARMER}),
    "glossy": _case(COLORED, GLOSSY, {"Color": WARM, "Roughness": 0.5}, {"Color": WARMER}),
    "F82 metal": _case(COLORED, METALLIC, METAL, {"Base_Color": WARMER}),
    "F82 metal, brighter than white": _case(
        SurfaceEdit(gain=1.6), METALLIC, METAL, {"Base_Color": _by((1.6, 1.6, 1.6))}),
    "plastic": _case(
        COLORED, PRINCIPLED, {"Base_Color": WARM, "Roughness": 0.4}, {"Base_Color": WARMER}),
    "texture": _case(
        COLORED, PRINCIPLED, {"Base_Color": _noise, "Roughness": 0.4},
        {"Base_Color": _noise_by(COLORED.color_factor)}),
    "textured metal": _case(
        COLORED, PRINCIPLED, {"Base_Color": _noise, "Roughness": 0.4, "Metallic": 1.0},
        {"Base_Color": _noise_by(COLORED.color_factor)}),
    "half metal": _case(
        COLORED, PRINCIPLED, {"Base_Color": WARM, "Roughness": 0.4, "Metallic": 0.5},
        {"Base_Color": WARMER}),
    "metal with an edge tint": _case(
        COLORED, PRINCIPLED,
        {"Base_Color": WARM, "Roughness": 0.4, "Metallic": 1.0, "Specular_Tint": (0.4, 0.7, 1.0)},
        {"Base_Color": WARMER}),
    "principled sheen": _case(
        SurfaceEdit(gain=0.4), PRINCIPLED,
        {"Base_Color": WARM, "Sheen_Weight": 0.8, "Sheen_Roughness": 0.6},
        {"Base_Color": _by((0.4, 0.4, 0.4)), "Sheen_Tint": (0.4, 0.4, 0.4)}),
    "Fresnel mix": Case(
        _mix(WARM, (1.0, 1.0, 1.0)), COLORED, _mix(WARMER, COLORED.color_factor)),
    "no colour": _case(
        SurfaceEdit(gain=0.0), PRINCIPLED, {"Base_Color": WARM, "Roughness": 0.4},
        {"Base_Color": (0.0, 0.0, 0.0)}),
    "emission": _case(
        SurfaceEdit(emission=3.0), PRINCIPLED,
        {"Base_Color": WARM, "Emission_Color": WARM, "Emission_Strength": 0.1},
        {"Emission_Strength": 0.3}),
    "rougher gloss": _case(
        ROUGHER, GLOSSY, {"Color": WARM, "Roughness": 0.3}, {"Roughness": 0.5}),
    "rougher, anisotropic": _case(
        ROUGHER, GLOSSY, {"Color": WARM, "Roughness": 0.3, "Anisotropy": 0.6},
        {"Roughness": 0.5}),
    "rougher plastic": _case(
        ROUGHER, PRINCIPLED, {"Base_Color": WARM, "Roughness": 0.3}, {"Roughness": 0.5}),
    "smoother metal": _case(
        SurfaceEdit(roughness=0.5), PRINCIPLED,
        {"Base_Color": WARM, "Roughness": 0.8, "Metallic": 1.0}, {"Roughness": 0.4}),
    "roughest": _case(
        SurfaceEdit(roughness=9.0), PRINCIPLED,
        {"Base_Color": WARM, "Roughness": 0.3, "Metallic": 1.0}, {"Roughness": 1.0}),
    "rougher texture": _case(
        SurfaceEdit(roughness=0.6, roughness_offset=0.2), PRINCIPLED,
        {"Base_Color": WARM, "Roughness": _grain(1.0, 0.0)}, {"Roughness": _grain(0.6, 0.2)}),
    "rougher coat": _case(
        ROUGHER, PRINCIPLED,
        {"Base_Color": WARM, "Roughness": 0.3, "Coat_Weight": 0.7, "Coat_Roughness": 0.1},
        {"Roughness": 0.5, "Coat_Roughness": 0.2}),
    "twice the specular": _case(
        SurfaceEdit(specular=2.0), PRINCIPLED, {"Base_Color": WARM, "Roughness": 0.4},
        {"Specular_IOR_Level": 1.0}),
    "a fifth of the specular": _case(
        SurfaceEdit(specular=0.2), PRINCIPLED, {"Base_Color": WARM, "Roughness": 0.4},
        {"Specular_IOR_Level": 0.1}),
    "no specular": _case(
        SurfaceEdit(specular=0.0), PRINCIPLED, {"Base_Color": WARM, "Roughness": 0.4},
        {"Specular_IOR_Level": 0.0}),
    "specular tint": _case(
        SurfaceEdit(specular=1.5, specular_tint=TINT), PRINCIPLED,
        {"Base_Color": WARM, "Roughness": 0.4},
        {"Specular_IOR_Level": 0.75, "Specular_Tint": TINT}),
    "tint on a tint": _case(
        SurfaceEdit(specular_tint=TINT), PRINCIPLED,
        {"Base_Color": WARM, "Roughness": 0.4, "Specular_Tint": (1.0, 0.5, 0.2)},
        {"Specular_Tint": _by(TINT, (1.0, 0.5, 0.2))}),
    "half the gloss": Case(
        _node(GLOSSY, Color=WARM, Roughness=0.5), SurfaceEdit(specular=0.5),
        _half(_node(GLOSSY, Color=WARM, Roughness=0.5))),
    "half the metal": Case(
        _node(METALLIC, **METAL), SurfaceEdit(specular=0.5), _half(_node(METALLIC, **METAL))),
    "specular of a coat": _case(
        SurfaceEdit(specular=0.5), PRINCIPLED,
        {"Base_Color": WARM, "Coat_Weight": 0.6, "Coat_Roughness": 0.2, "Coat_IOR": 1.8},
        {"Specular_IOR_Level": 0.25, "Coat_IOR": _ior(0.5 * COAT_F0)}),
    "all of it": _case(
        SurfaceEdit(0.8, TINT, 1.5, 0.05, 1.4), PRINCIPLED,
        {"Base_Color": _noise, "Roughness": 0.3, "Metallic": 0.0},
        {"Base_Color": _noise_by(COLORED.color_factor), "Roughness": 0.5,
         "Specular_IOR_Level": 0.7}),
}  # fmt: skip

ROWS = -(-len(CASES) // COLUMNS)


def _build() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    for index, (name, case) in enumerate(CASES.items()):
        row, column = divmod(index, COLUMNS)
        place = (column + 0.5 - COLUMNS / 2, 0.0, row + 0.5 - ROWS / 2)
        bpy.ops.mesh.primitive_uv_sphere_add(
            segments=128, ring_count=64, radius=0.45, location=place
        )
        ball: Any = bpy.context.object
        ball.data.shade_smooth()
        # What glows is seen, and lights nothing.
        ball.visible_diffuse = ball.visible_glossy = case.edit.emission == 1.0
        material: Any = bpy.data.materials.new(name)
        _shade(material, case.baked)
        ball.data.materials.append(material)
    light: Any = bpy.data.lights.new("Key", "POINT")
    light.energy, light.shadow_soft_size, light.use_shadow = 2000.0, 0.0, False
    lamp = bpy.data.objects.new("Key", light)
    lamp.location = (-7.0, -4.0, 4.0)
    scene.collection.objects.link(lamp)
    data: Any = bpy.data.cameras.new("Camera")
    data.type, data.ortho_scale = "ORTHO", float(max(COLUMNS, ROWS))
    camera = bpy.data.objects.new("Camera", data)
    camera.location, camera.rotation_euler = (0.0, -20.0, 0.0), (np.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = COLUMNS * PIXELS, ROWS * PIXELS
    return scene


def _shade(material: Any, shader: Shader) -> None:
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader(tree), output.inputs["Surface"])


@dataclass(frozen=True)
class Pictures:
    relit: NDArray[np.float64]
    cycles: NDArray[np.float64]
    plain: NDArray[np.float64]
    applied: NDArray[np.float64]
    refused: dict[str, str]

    def of(self, index: int) -> tuple[NDArray[np.float64], ...]:
        """A ball's cell in each, away from its outline."""
        row, column = divmod(index, COLUMNS)
        rows = slice(row * PIXELS, (row + 1) * PIXELS)
        columns = slice(column * PIXELS, (column + 1) * PIXELS)
        y, x = np.mgrid[:PIXELS, :PIXELS] + 0.5 - PIXELS / 2
        # The ball's radius is 0.45 of a cell.
        inside = np.hypot(x, y) < 0.42 * PIXELS
        pictures = (self.relit, self.cycles, self.plain, self.applied)
        return tuple(each[rows, columns][inside] for each in pictures)


@pytest.fixture(scope="module")
def pictures(gpu_context: None, tmp_path_factory: pytest.TempPathFactory) -> Pictures:
    from addon.relight.session import RelightSession

    folder = tmp_path_factory.mktemp("edits")
    scene = _build()
    geometry, lights, view = with_render_depsgraph(
        scene, lambda d: (read_geometry(d), read_lights(d), read_view(d, scene.camera))
    )
    # Far away, and so nearly along the view's parallel rays: all of the picture is seen.
    world_from_camera = view.world_from_camera.copy()
    world_from_camera[:3, 3] = (0.0, -100.0, 0.0)
    fov = 2.0 * np.arctan(0.51 * max(COLUMNS, ROWS) / 99.5)
    caching = CachingCamera(0, world_from_camera, float(fov), 50.0, 150.0, 2048, "PERSPECTIVE", 0)
    bake_scene(scene, geometry, [caching], folder / "cache")
    store = CacheStore.open(folder / "cache")
    session = RelightSession(geometry, store, 1, mesh_lights=False)
    session.set_lights(lights)
    session.set_view(view)
    plain = session.render().combined
    session.set_surface_edits(SurfaceEdits({name: case.edit for name, case in CASES.items()}))
    relit = session.render().combined
    session.set_surface_edits(SurfaceEdits())
    # Taken back, they leave nothing behind.
    assert np.array_equal(session.render().combined, plain)
    for name, case in CASES.items():
        _shade(bpy.data.materials[name], case.changed)
    cycles = cycles_picture(scene, folder / "cycles.exr", 1)
    refused = {}
    for name, case in CASES.items():
        _shade(bpy.data.materials[name], case.baked)
        try:
            apply_edit(bpy.data.materials[name], case.edit)
        except InputError as error:
            refused[name] = str(error)
    applied = cycles_picture(scene, folder / "applied.exr", 1)
    each = [picture[..., :3].astype(np.float64) for picture in (relit, cycles, plain, applied)]
    return Pictures(each[0], each[1], each[2], each[3], refused)


# What is left is 8-bit albedos, as in test_lobes_against_cycles.py; a tint may make what was a dark
# component, with the coarser steps, the brightest one.
MEAN = 0.005
PSNR = 57.0

# The largest component of a tinted reflectance is also what Fresnel's curve starts from; in Cycles
# that is the reflectance without its tint.
APPROXIMATED = {"tint on a tint": (0.01, 50.0)}


@pytest.mark.parametrize("name", CASES)
def test_an_edit(pictures: Pictures, name: str) -> None:
    relit, cycles, plain, _ = pictures.of(list(CASES).index(name))
    assert np.isfinite(relit).all()
    assert cycles.max() > 0.001
    # The edit shows at all.
    assert np.abs(relit - plain).max() > 0.05 * plain.max()
    error = np.sqrt(((relit - cycles) ** 2).mean()) / cycles.max()
    psnr, off = -20.0 * np.log10(error), relit.mean() / cycles.mean() - 1.0
    mean, least = APPROXIMATED.get(name, (MEAN, PSNR))
    assert psnr > least, f"{psnr:.1f} dB, mean {off:+.2%}"
    assert abs(off) < mean, f"{psnr:.1f} dB, mean {off:+.2%}"


@pytest.mark.parametrize("name", CASES)
def test_what_is_applied_to_the_nodes_looks_the_same(pictures: Pictures, name: str) -> None:
    assert name not in pictures.refused
    _, cycles, _, applied = pictures.of(list(CASES).index(name))
    # Cycles computes the same with numbers that may be a rounding apart.
    np.testing.assert_allclose(applied, cycles, rtol=1e-4, atol=1e-5 * cycles.max())
