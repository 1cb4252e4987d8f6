# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's materials: image and procedural textures, bump, metal, mixes and cut-outs."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

Color = tuple[float, float, float]


class Tree:
    """A material's node tree, written as expressions: sockets in, a socket out."""

    def __init__(self, name: str) -> None:
        material: Any = bpy.data.materials.new(name)
        material.node_tree.nodes.clear()
        self.material, self.tree = material, material.node_tree

    def node(self, kind: str, inputs: dict[str, Any] | None = None, **settings: Any) -> Any:
        """Add a node; an input is a value, or another node's output socket."""
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for name, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[name])
            elif isinstance(value, tuple) and len(value) == 3 and node.inputs[name].type == "RGBA":
                node.inputs[name].default_value = (*value, 1.0)
            else:
                node.inputs[name].default_value = value
        return node

    def surface(self, shader: Any) -> Any:
        """Make this the material's surface, and give the material."""
        output = self.node("ShaderNodeOutputMaterial")
        self.tree.links.new(shader, output.inputs["Surface"])
        return self.material

    def principled(self, **inputs: Any) -> Any:
        """A Principled BSDF's output; inputs in snake case."""
        named = {name.replace("_", " ").title(): value for name, value in inputs.items()}
        if "Specular Ior Level" in named:
            named["Specular IOR Level"] = named.pop("Specular Ior Level")
        return self.node("ShaderNodeBsdfPrincipled", named).outputs["BSDF"]

    def ramp(self, factor: Any, stops: list[tuple[float, Color]]) -> Any:
        """A colour ramp's output."""
        node = self.node("ShaderNodeValToRGB", {"Fac": factor})
        elements = node.color_ramp.elements
        for _ in stops[2:]:
            elements.new(1.0)
        for element, (position, color) in zip(elements, stops, strict=True):
            element.position = position
            element.color = (*color, 1.0)
        return node.outputs["Color"]

    def coordinates(self, scale: tuple[float, float, float] = (1, 1, 1)) -> Any:
        """Object coordinates, in metres times `scale`."""
        source = self.node("ShaderNodeTexCoord").outputs["Object"]
        return self.node("ShaderNodeMapping", {"Vector": source, "Scale": scale}).outputs["Vector"]

    def noise(self, scale: float, detail: float = 2.0, vector: Any = None) -> Any:
        """A noise texture's factor."""
        inputs = {"Scale": scale, "Detail": detail, "Vector": vector or self.coordinates()}
        return self.node("ShaderNodeTexNoise", inputs).outputs[0]

    def bump(self, height: Any, distance: float, strength: float = 1.0) -> Any:
        """A bumped normal; `distance` in metres."""
        inputs = {"Height": height, "Distance": distance, "Strength": strength}
        return self.node("ShaderNodeBump", inputs).outputs["Normal"]

    def image(self, name: str, pixels: NDArray[np.float32]) -> Any:
        """An image texture node over the active UV map; the image is packed into the file."""
        height, width = pixels.shape[:2]
        image: Any = bpy.data.images.new(name, width, height, alpha=True)
        image.pixels.foreach_set(np.ascontiguousarray(pixels, dtype=np.float32).ravel())
        image.pack()
        return self.node("ShaderNodeTexImage", image=image, extension="EXTEND")


def paint(name: str, color: Color, roughness: float = 0.6, grain: float = 0.0) -> Any:
    """Plain paint; `grain` is the depth of its roller marks in metres."""
    tree = Tree(name)
    inputs: dict[str, Any] = {"base_color": color, "roughness": roughness}
    if grain > 0.0:
        inputs["normal"] = tree.bump(tree.noise(18.0, 0.0), grain)
    return tree.surface(tree.principled(**inputs))


def metal(name: str, color: Color, roughness: float) -> Any:
    """Bare metal."""
    tree = Tree(name)
    return tree.surface(tree.principled(base_color=color, metallic=1.0, roughness=roughness))


def wood(name: str, dark: Color, light: Color, roughness: float = 0.4) -> Any:
    """Procedural grain along the object's X axis."""
    tree = Tree(name)
    grain = tree.noise(3.0, 4.0, tree.coordinates((1.5, 14.0, 14.0)))
    color = tree.ramp(grain, [(0.32, dark), (0.68, light)])
    return tree.surface(tree.principled(base_color=color, roughness=roughness))


def floor_boards() -> Any:
    """Varnished boards: each of its own shade, with grain, and grooves between them."""
    tree = Tree("Boards")
    bricks = tree.node(
        "ShaderNodeTexBrick",
        {
            "Vector": tree.coordinates(), "Scale": 1.0, "Mortar Size": 0.006,
            "Mortar Smooth": 0.5, "Brick Width": 1.6, "Row Height": 0.17,
            "Color1": (0.34, 0.19, 0.10), "Color2": (0.47, 0.29, 0.16),
            "Mortar": (0.08, 0.05, 0.03),
        },
        offset=0.37,
    )  # fmt: skip
    grain = tree.noise(4.0, 3.0, tree.coordinates((1.2, 12.0, 1.0)))
    shade = tree.ramp(grain, [(0.3, (0.72, 0.72, 0.72)), (0.7, (1.0, 1.0, 1.0))])
    color = tree.node("ShaderNodeMix", data_type="RGBA", blend_type="MULTIPLY")
    sockets = [socket for socket in color.inputs if socket.type == "RGBA"]
    color.inputs[0].default_value = 1.0
    tree.tree.links.new(bricks.outputs["Color"], sockets[0])
    tree.tree.links.new(shade, sockets[1])
    result = next(socket for socket in color.outputs if socket.type == "RGBA")
    groove = tree.bump(bricks.outputs["Fac"], -0.002)
    return tree.surface(tree.principled(base_color=result, roughness=0.38, normal=groove))


def woven(name: str, pixels: NDArray[np.float32]) -> Any:
    """Cloth with an image: a plain Diffuse BSDF."""
    tree = Tree(name)
    color = tree.image(name, pixels).outputs["Color"]
    return tree.surface(tree.node("ShaderNodeBsdfDiffuse", {"Color": color}).outputs["BSDF"])


def picture(name: str, pixels: NDArray[np.float32]) -> Any:
    """A varnished painting."""
    tree = Tree(name)
    color = tree.image(name, pixels).outputs["Color"]
    canvas = tree.bump(tree.noise(35.0), 0.001)
    return tree.surface(tree.principled(base_color=color, roughness=0.45, normal=canvas))


def cut_out(name: str, pixels: NDArray[np.float32], roughness: float) -> Any:
    """An image whose alpha cuts the surface away."""
    tree = Tree(name)
    image = tree.image(name, pixels)
    inputs = {"base_color": image.outputs["Color"], "alpha": image.outputs["Alpha"]}
    return tree.surface(tree.principled(**inputs, roughness=roughness))


def patina() -> Any:
    """Bronze under verdigris: a Mix Shader of Glossy and Diffuse by a noise."""
    tree = Tree("Patina")
    bronze = tree.node("ShaderNodeBsdfGlossy", {"Color": (0.80, 0.50, 0.24), "Roughness": 0.42})
    green = tree.node("ShaderNodeBsdfDiffuse", {"Color": (0.20, 0.42, 0.34)})
    factor = tree.node("ShaderNodeMapRange", {"Value": tree.noise(5.0, 3.0), "From Min": 0.42,
                                              "From Max": 0.62})  # fmt: skip
    mix = tree.node("ShaderNodeMixShader", {"Fac": factor.outputs[0]})
    tree.tree.links.new(bronze.outputs["BSDF"], mix.inputs[1])
    tree.tree.links.new(green.outputs["BSDF"], mix.inputs[2])
    return tree.surface(mix.outputs["Shader"])


def glow(name: str, color: Color, strength: float) -> Any:
    """A surface that sends out light by itself."""
    tree = Tree(name)
    inputs = {"Color": color, "Strength": strength}
    return tree.surface(tree.node("ShaderNodeEmission", inputs).outputs["Emission"])


def peel() -> Any:
    """An orange."""
    tree = Tree("Peel")
    dimples = tree.bump(tree.noise(60.0, 0.0), 0.002)
    return tree.surface(
        tree.principled(base_color=(0.85, 0.35, 0.05), roughness=0.35, normal=dimples)
    )
