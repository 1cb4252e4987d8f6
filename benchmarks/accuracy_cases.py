# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights and the lobes whose pairs `benchmarks.accuracy` holds against Cycles."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

R = math.radians
WARM = (0.8, 0.5, 0.2)

Make = Callable[[Any], Any]  # of a material's node tree: the closure's socket


def _node(tree: Any, kind: str, **inputs: Any) -> Any:
    """A node; `set_x` is an attribute, any other keyword an input with _ for a space."""
    node = tree.nodes.new(kind)
    for key, value in inputs.items():
        if key.startswith("set_"):
            setattr(node, key.removeprefix("set_"), value)
            continue
        socket = node.inputs[key.replace("_", " ")]
        socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
    return node


def _bsdf(kind: str, **inputs: Any) -> Make:
    return lambda tree: _node(tree, f"ShaderNodeBsdf{kind}", **inputs).outputs[0]


def _gloss(**inputs: Any) -> Make:
    return _bsdf("Anisotropic", Color=WARM, **inputs)


def _principled(**inputs: Any) -> Make:
    return _bsdf("Principled", Base_Color=WARM, **inputs)


def _metal(roughness: float, **inputs: Any) -> Make:
    return _principled(Metallic=1.0, Roughness=roughness, **inputs)


def _both(node: str, first: Make, second: Make, factor: Make | float | None = None) -> Make:
    def make(tree: Any) -> Any:
        joined = _node(tree, f"ShaderNode{node}Shader")
        sockets = [socket for socket in joined.inputs if socket.type == "SHADER"]
        for socket, shader in zip(sockets, (first, second), strict=True):
            tree.links.new(shader(tree), socket)
        if callable(factor):
            tree.links.new(factor(tree), joined.inputs[0])
        elif factor is not None:
            joined.inputs[0].default_value = factor
        return joined.outputs[0]

    return make


_MATTE = _bsdf("Diffuse", Color=WARM)

LOBES: dict[str, Make] = {
    "Lambert": _MATTE,
    "Oren-Nayar 0.8": _bsdf("Diffuse", Color=WARM, Roughness=0.8),
    "translucent": _bsdf("Translucent", Color=WARM),
    "plastic 0.05": _principled(Roughness=0.05),
    "plastic 0.3": _principled(Roughness=0.3),
    "plastic 0.7": _principled(Roughness=0.7),
    "metal 0 (mirror)": _metal(0.0),
    "metal 0.05": _metal(0.05),
    "metal 0.1": _metal(0.1),
    "metal 0.2": _metal(0.2),
    "metal 0.5": _metal(0.5),
    "metal 1": _metal(1.0),
    "anisotropic 0.3": _metal(0.3, Anisotropic=0.7),
    "F82 tint 0.3": _bsdf("Metallic", Base_Color=WARM, Edge_Tint=(0.2, 0.5, 0.9), Roughness=0.3),
    "GGX, one bounce 0.2": _gloss(Roughness=0.2, set_distribution="GGX"),
    "Beckmann 0.2": _gloss(Roughness=0.2, set_distribution="BECKMANN"),
    "anisotropic Beckmann 0.3": _gloss(
        Roughness=0.3, Anisotropy=0.6, set_distribution="BECKMANN"),
    "Ashikhmin-Shirley 0.2": _gloss(Roughness=0.2, set_distribution="ASHIKHMIN_SHIRLEY"),
    "coat 0.1": _principled(Coat_Weight=1.0, Coat_Roughness=0.1, Roughness=0.6),
    "sheen 0.5": _principled(Sheen_Weight=0.8, Sheen_Roughness=0.5, Roughness=0.6),
    "sheen alone": _bsdf("Sheen", Color=WARM, Roughness=0.6),
    "mix": _both("Mix", _MATTE, _gloss(Roughness=0.2), 0.4),
    "Fresnel mix": _both(
        "Mix", _MATTE, _gloss(Roughness=0.15),
        lambda tree: _node(tree, "ShaderNodeFresnel", IOR=1.8).outputs[0]),
    "two glossy": _both("Add", _gloss(Roughness=0.15), _gloss(Roughness=0.6)),
}  # fmt: skip

SIZES = ("shadow_soft_size", "size", "size_y")
OF_THE_OBJECT = ("scale", "visible_diffuse", "visible_glossy")

_SOFT = {"shadow_soft_size": 0.4}
_SPHERE = {"use_soft_falloff": False}

LIGHTS: dict[str, tuple[str, dict[str, Any]]] = {
    "point": ("POINT", {}),
    "point, disk": ("POINT", _SOFT),
    "point, large disk": ("POINT", {"shadow_soft_size": 1.5}),
    "point, sphere": ("POINT", _SOFT | _SPHERE),
    "point, large sphere": (
        "POINT", _SPHERE | {"shadow_soft_size": 1.5, "normalize": False, "energy_factor": 0.1}),
    "point, warm, exposed": (
        "POINT", {"use_temperature": True, "temperature": 3000.0, "exposure": 1.5}),
    "point, no diffuse": ("POINT", _SOFT | {"visible_diffuse": False}),
    "point, no specular": ("POINT", _SOFT | {"visible_glossy": False}),
    "spot": ("SPOT", {"spot_size": R(35), "spot_blend": 0.3}),
    "spot, disk": ("SPOT", _SOFT | {"spot_size": R(35), "spot_blend": 1.0}),
    "spot, sphere": ("SPOT", _SOFT | _SPHERE | {"spot_size": R(35), "spot_blend": 0.5}),
    "spot, wide": ("SPOT", _SOFT | {"spot_size": R(140), "spot_blend": 0.2}),
    "spot, stretched": (
        "SPOT", {"spot_size": R(30), "spot_blend": 1.0, "scale": (1.0, 1.7, 1.0)}),
    "sun": ("SUN", {"angle": 0.0}),
    "sun, 10 degrees": ("SUN", {"angle": R(10)}),
    "sun, 60 degrees": ("SUN", {"angle": R(60)}),
    "sun, not normalized": ("SUN", {"angle": R(20), "normalize": False, "energy_factor": 10.0}),
    "area, square": ("AREA", {"size": 1.5}),
    "area, large square": ("AREA", {"size": 5.0}),
    "area, rectangle": ("AREA", {"shape": "RECTANGLE", "size": 4.0, "size_y": 0.5}),
    "area, disk": ("AREA", {"shape": "DISK", "size": 2.5}),
    "area, ellipse, not normalized": (
        "AREA", {"shape": "ELLIPSE", "size": 3.0, "size_y": 1.2, "normalize": False,
                 "energy_factor": 0.3}),
    "area, spread": ("AREA", {"shape": "SQUARE", "size": 2.0, "spread": R(60)}),
    "world, constant": ("WORLD", {}),
    "world, gradient": ("WORLD", {"gradient": True}),
}  # fmt: skip

# W, or W/m2: a white surface at the set-ups' distances is about as bright as a display's white.
_ENERGY = {"POINT": 3000.0, "SPOT": 3000.0, "AREA": 1000.0, "SUN": 3.0}


def is_soft(name: str) -> bool:
    """Whether points of the light, or of the world, differ."""
    kind, settings = LIGHTS[name]
    sizes = ("angle", "shadow_soft_size", "size")
    return kind in ("AREA", "WORLD") or any(settings.get(size, 0.0) > 0.0 for size in sizes)


def add_light(scene: Any, name: str, world_from_light: np.ndarray, scale: float) -> None:
    """Put a light into the scene: the only one.

    Args:
        scene: a `bpy.types.Scene`.
        name: of LIGHTS.
        world_from_light: (4, 4), where it is.
        scale: times the sizes; the energy goes with its square.
    """
    kind, settings = LIGHTS[name]
    scene.world = None
    if kind == "WORLD":
        scene.world = bpy.data.worlds["gradient" if settings.get("gradient") else "constant"]
        return
    data: Any = bpy.data.lights.new("Light", kind)
    lamp: Any = bpy.data.objects.new("Light", data)
    scene.collection.objects.link(lamp)
    data.energy = _ENERGY[kind] * (1.0 if kind == "SUN" else scale**2)
    data.energy *= settings.get("energy_factor", 1.0)
    if kind in ("POINT", "SPOT"):
        data.shadow_soft_size = 0.0
    lamp.matrix_world = world_from_light.T.tolist()
    for key, value in settings.items():
        if key != "energy_factor":
            on = lamp if key in OF_THE_OBJECT else data
            setattr(on, key, value * scale if key in SIZES else value)


def add_worlds() -> None:
    """The two worlds of LIGHTS."""
    for name in ("constant", "gradient"):
        world: Any = bpy.data.worlds.new(name)
        tree = world.node_tree
        tree.nodes.clear()
        back = _node(tree, "ShaderNodeBackground", Color=(0.5, 0.7, 0.9))
        output = tree.nodes.new("ShaderNodeOutputWorld")
        tree.links.new(back.outputs[0], output.inputs[0])
        if name == "gradient":
            # From dark below to bright above.
            at = tree.nodes.new("ShaderNodeTexCoord")
            split = tree.nodes.new("ShaderNodeSeparateXYZ")
            ramp = _node(tree, "ShaderNodeMapRange")
            ramp.inputs["From Min"].default_value = -1.0
            tree.links.new(at.outputs["Generated"], split.inputs[0])
            tree.links.new(split.outputs[2], ramp.inputs[0])
            tree.links.new(ramp.outputs[0], back.inputs["Color"])
