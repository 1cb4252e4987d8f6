# SPDX-License-Identifier: GPL-3.0-or-later
"""Every kind of lobe against Cycles: balls under one point light, baked, relit and rendered.

The light is a point without shadow, so Cycles' picture has no noise, and both renderers look
through the pixels' centres.
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
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.light_reader import read_lights
from addon.scene.view_reader import read_view

from .test_against_cycles import cycles_picture

PIXELS = 60  # of a ball's cell
COLUMNS = 6
WARM = (0.8, 0.5, 0.2)


def _node(tree: Any, kind: str, **inputs: Any) -> Any:
    node = tree.nodes.new(kind)
    for key, value in inputs.items():
        if key.startswith("set_"):
            setattr(node, key.removeprefix("set_"), value)
            continue
        socket = node.inputs[key.replace("_", " ")]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
    return node


def _single(kind: str, **inputs: Any) -> Callable[[Any], Any]:
    return lambda tree: _node(tree, kind, **inputs).outputs[0]


def _glossy(**inputs: Any) -> Callable[[Any], Any]:
    return _single("ShaderNodeBsdfAnisotropic", Color=WARM, **inputs)


def _principled(**inputs: Any) -> Callable[[Any], Any]:
    return _single("ShaderNodeBsdfPrincipled", Base_Color=WARM, **inputs)


def _mix(factor: Callable[[Any], Any] | float) -> Callable[[Any], Any]:
    def make(tree: Any) -> Any:
        matte = _node(tree, "ShaderNodeBsdfDiffuse", Color=WARM).outputs[0]
        shiny = _node(tree, "ShaderNodeBsdfAnisotropic", Color=(1, 1, 1), Roughness=0.3).outputs[0]
        mix = _node(tree, "ShaderNodeMixShader")
        if callable(factor):
            tree.links.new(factor(tree), mix.inputs[0])
        else:
            mix.inputs[0].default_value = factor
        tree.links.new(matte, mix.inputs[1])
        tree.links.new(shiny, mix.inputs[2])
        return mix.outputs[0]

    return make


def _share_of(shader: Callable[[Any], Any], share: float) -> Callable[[Any], Any]:
    """So much of a shader, and of the rest nothing."""

    def make(tree: Any) -> Any:
        mix = _node(tree, "ShaderNodeMixShader")
        mix.inputs[0].default_value = share
        tree.links.new(shader(tree), mix.inputs[2])
        return mix.outputs[0]

    return make


def _layer_weight(output: str, blend: float) -> Callable[[Any], Any]:
    return lambda tree: _node(tree, "ShaderNodeLayerWeight", Blend=blend).outputs[output]


def _two_gloss(tree: Any) -> Any:
    add = _node(tree, "ShaderNodeAddShader")
    for index, roughness in enumerate((0.15, 0.6)):
        node = _node(tree, "ShaderNodeBsdfAnisotropic", Color=WARM, Roughness=roughness)
        tree.links.new(node.outputs[0], add.inputs[index])
    return add.outputs[0]


def _leaning(**inputs: Any) -> Callable[[Any], Any]:
    """A Principled BSDF whose normal leans aside, as bumps have it; that of its coat does not."""

    def make(tree: Any) -> Any:
        lean = _node(tree, "ShaderNodeVectorMath")
        tree.links.new(_node(tree, "ShaderNodeNewGeometry").outputs["Normal"], lean.inputs[0])
        lean.inputs[1].default_value = (0.3, 0.0, 0.2)
        node = _node(tree, "ShaderNodeBsdfPrincipled", Base_Color=WARM, **inputs)
        tree.links.new(lean.outputs[0], node.inputs["Normal"])
        return node.outputs[0]

    return make


METALLIC = "ShaderNodeBsdfMetallic"
CASES: dict[str, Callable[[Any], Any]] = {
    "diffuse": _single("ShaderNodeBsdfDiffuse", Color=WARM),
    "rough diffuse": _single("ShaderNodeBsdfDiffuse", Color=WARM, Roughness=0.8),
    "translucent": _single("ShaderNodeBsdfTranslucent", Color=WARM),
    "multiscatter GGX": _glossy(Roughness=0.5, set_distribution="MULTI_GGX"),
    "GGX": _glossy(Roughness=0.5, set_distribution="GGX"),
    "Beckmann": _glossy(Roughness=0.5, set_distribution="BECKMANN"),
    "Ashikhmin-Shirley": _glossy(Roughness=0.5, set_distribution="ASHIKHMIN_SHIRLEY"),
    "anisotropic GGX": _glossy(Roughness=0.5, Anisotropy=0.6, set_distribution="GGX"),
    "turned": _glossy(Roughness=0.5, Anisotropy=-0.6, Rotation=0.15, set_distribution="GGX"),
    "anisotropic Beckmann": _glossy(
        Roughness=0.5, Anisotropy=0.5, set_distribution="BECKMANN"),
    "anisotropic Ashikhmin-Shirley": _glossy(
        Roughness=0.5, Anisotropy=0.4, set_distribution="ASHIKHMIN_SHIRLEY"),
    "F82 metal": _single(
        METALLIC, Base_Color=WARM, Edge_Tint=(0.2, 0.5, 0.9), Roughness=0.4),
    "conductor": _single(
        METALLIC, set_fresnel_type="PHYSICAL_CONDUCTOR", IOR=(0.18, 0.42, 1.37),
        Extinction=(3.42, 2.35, 1.77), Roughness=0.4),
    "principled": _principled(Roughness=0.4),
    "principled, metal with a tint": _principled(
        Metallic=0.7, Specular_Tint=(0.4, 0.7, 1.0), Roughness=0.4),
    "principled, rough diffuse": _principled(Diffuse_Roughness=0.9, Roughness=0.6),
    "principled, anisotropic": _principled(
        Metallic=1.0, Anisotropic=0.8, Anisotropic_Rotation=0.1, Roughness=0.4),
    "principled, GGX": _principled(Metallic=1.0, Roughness=0.8, set_distribution="GGX"),
    "coat": _principled(Coat_Weight=1.0, Coat_Roughness=0.2, Roughness=0.7),
    "a coat on what leans": _leaning(Coat_Weight=1.0, Coat_Roughness=0.2, Roughness=0.7),
    "half a coat on metal": _principled(
        Coat_Weight=0.5, Coat_Roughness=0.3, Coat_IOR=1.8, Roughness=0.5, Metallic=1.0),
    "sheen": _single("ShaderNodeBsdfSheen", Color=WARM, Roughness=0.6),
    "rough sheen": _single("ShaderNodeBsdfSheen", Color=WARM, Roughness=0.93),
    "principled, sheen": _principled(Sheen_Weight=0.8, Sheen_Roughness=0.6, Roughness=0.5),
    "principled, sheen on a coat": _principled(
        Sheen_Weight=0.5, Coat_Weight=0.4, Sheen_Tint=(0.3, 0.6, 0.9), Roughness=0.5),
    "mix": _mix(0.4),
    "Fresnel mix": _mix(lambda tree: _node(tree, "ShaderNodeFresnel", IOR=1.8).outputs[0]),
    "facing mix": _mix(_layer_weight("Facing", 0.3)),
    "layer weight's Fresnel mix": _mix(_layer_weight("Fresnel", 0.4)),
    "facing mix, steep": _mix(_layer_weight("Facing", 0.8)),
    "two glossy lobes": _two_gloss,
    "a share of rough gloss": _share_of(_glossy(Roughness=0.9), 0.3),
    "a share of rough diffuse": _share_of(
        _single("ShaderNodeBsdfDiffuse", Color=(0.9, 0.8, 0.5), Roughness=1.0), 0.3),
    "rough half metal": _principled(Metallic=0.5, Roughness=0.9),
    "a share of a rough half metal": _share_of(
        _principled(Metallic=0.5, Roughness=0.9, Diffuse_Roughness=1.0), 0.3),
}  # fmt: skip

ROWS = -(-len(CASES) // COLUMNS)


@dataclass(frozen=True)
class Pictures:
    relit: NDArray[np.float64]
    cycles: NDArray[np.float64]

    def of(self, index: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """A ball's cell in both, away from its outline."""
        row, column = divmod(index, COLUMNS)
        rows = slice(row * PIXELS, (row + 1) * PIXELS)
        columns = slice(column * PIXELS, (column + 1) * PIXELS)
        y, x = np.mgrid[:PIXELS, :PIXELS] + 0.5 - PIXELS / 2
        # The ball's radius is 0.45 of a cell.
        inside = np.hypot(x, y) < 0.42 * PIXELS
        return self.relit[rows, columns][inside], self.cycles[rows, columns][inside]


def _build() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    for index, (name, make) in enumerate(CASES.items()):
        row, column = divmod(index, COLUMNS)
        place = (column + 0.5 - COLUMNS / 2, 0.0, row + 0.5 - ROWS / 2)
        bpy.ops.mesh.primitive_uv_sphere_add(
            segments=128, ring_count=64, radius=0.45, location=place
        )
        ball: Any = bpy.context.object
        ball.data.shade_smooth()
        made: Any = bpy.data.materials.new(name)
        made.node_tree.nodes.clear()
        output = made.node_tree.nodes.new("ShaderNodeOutputMaterial")
        made.node_tree.links.new(make(made.node_tree), output.inputs["Surface"])
        ball.data.materials.append(made)
    # One light: of several Cycles takes one by chance for each sample. From the side, so that
    # light comes through some of what is seen.
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


@pytest.fixture(scope="module")
def pictures(gpu_context: None, tmp_path_factory: pytest.TempPathFactory) -> Pictures:
    from addon.relight.session import RelightSession

    folder = tmp_path_factory.mktemp("lobes")
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
    session = RelightSession(geometry, CacheStore.open(folder / "cache"), 1)
    session.set_lights(lights)
    session.set_view(view)
    relit = session.render().combined[..., :3].astype(np.float64)
    rendered = cycles_picture(scene, folder / "cycles.exr", 1)[..., :3]
    return Pictures(relit, rendered)


# What is left: 8-bit albedos, and normals between texels.
MEAN = 0.005
PSNR = 60.0

# Of two weights by the view one is kept from the front, and reported. Where a metal and a
# dielectric are one lobe, what bounces in each is told by its mean share in the reflectance. What
# a coat takes from the base is that of the base's normal, not of its own.
APPROXIMATED = {
    "a coat on what leans": 0.01,
    "principled, sheen on a coat": 0.03,
    "rough half metal": 0.01,
    "a share of a rough half metal": 0.01,
}


@pytest.mark.parametrize("name", CASES)
def test_a_lobe(pictures: Pictures, name: str) -> None:
    relit, cycles = pictures.of(list(CASES).index(name))
    assert np.isfinite(relit).all()
    assert cycles.mean() > 0.01
    assert abs(relit.mean() / cycles.mean() - 1.0) < APPROXIMATED.get(name, MEAN)
    if name in APPROXIMATED:
        return
    error = np.sqrt(((relit - cycles) ** 2).mean()) / cycles.max()
    assert -20.0 * np.log10(error) > PSNR
