# SPDX-License-Identifier: GPL-3.0-or-later
"""Every output of every shader node: named as depending on the view exactly where Cycles
shows another value to another camera."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import bpy
import numpy as np
import pytest

from addon.camplace.camera import CachingCamera

from ..synthetic import looking_at
from .material_grid import add_plane, camera_above, empty_material, empty_scene, node_in
from .plain_cycles import emission_of
from .view_trees import effects_of

# Texels along a plane's side, and along a picture's.
PLANE, HIGH, LOW = 4, 64, 48
TEXEL = 10.0 / HIGH

NEEDS_FILE = {"ShaderNodeTexIES", "ShaderNodeTexImage", "ShaderNodeTexEnvironment"}

# What two pictures of a plane cannot tell: there is no cut-out over it, and ambient occlusion is
# made of random rays.
UNTESTABLE = {
    ("ShaderNodeLightPath", "Transparent Depth"),
    ("ShaderNodeAmbientOcclusion", "AO"),
    ("ShaderNodeAmbientOcclusion", "Color"),
}


def vector_transforms(tree: Any) -> Iterator[tuple[str, Any]]:
    """From each space to each, as (the setting's name, a new node)."""
    spaces = ("WORLD", "OBJECT", "CAMERA")
    for vector_type, source, target in product(("POINT", "VECTOR", "NORMAL"), spaces, spaces):
        node = node_in(tree, "ShaderNodeVectorTransform", Vector=(0.3, 0.5, 0.8))
        node.vector_type = vector_type
        node.convert_from, node.convert_to = source, target
        yield f"{vector_type} {source} to {target}", node


def enumerated(tree: Any, kind: str, setting: str, **inputs: Any) -> Iterator[tuple[str, Any]]:
    """A node for each value of one of its settings."""
    for item in getattr(bpy.types, kind).bl_rna.properties[setting].enum_items:
        node = node_in(tree, kind, **inputs)
        setattr(node, setting, item.identifier)
        yield item.identifier, node


def configured(tree: Any, kind: str) -> Iterator[tuple[str, Any]]:
    """Each setting of a node that has a say in the question, as (its name, a new node)."""
    if kind == "ShaderNodeVectorTransform":
        yield from vector_transforms(tree)
    elif kind == "ShaderNodeLightFalloff":
        yield "sharp", node_in(tree, kind, Strength=1.0, Smooth=0.0)
        yield "smooth", node_in(tree, kind, Strength=1.0, Smooth=1.0)
    elif kind == "ShaderNodeNormalMap":
        yield from enumerated(tree, kind, "space", Color=(0.7, 0.6, 0.9))
    elif kind == "ShaderNodeTangent":
        yield from enumerated(tree, kind, "direction_type")
    elif kind == "ShaderNodeBump":
        yield "", node_in(tree, kind, Height=tree.nodes.new("ShaderNodeTexNoise").outputs[0])
    elif kind == "ShaderNodeRaycast":
        # From above, so that it does not begin within the rounding of the surface.
        yield "", node_in(tree, kind, Position=(0.3, 0.2, 0.7), Direction=(0.0, 0.0, -1.0))
    else:
        yield "", tree.nodes.new(kind)


def value_outputs(node: Any) -> Iterator[Any]:
    for output in node.outputs:
        if output.type in {"VALUE", "VECTOR", "RGBA", "INT", "BOOLEAN"} and output.enabled:
            yield output


def kinds() -> list[str]:
    """Shader nodes that give values."""
    tree = bpy.data.materials.new("kinds").node_tree
    found = []
    for kind in sorted(dir(bpy.types)):
        if kind.startswith("ShaderNode") and kind not in NEEDS_FILE:
            try:
                node = tree.nodes.new(kind)
            except RuntimeError:
                continue  # not of shader trees, or not to be made
            if next(value_outputs(node), None) is not None:
                found.append(kind)
    return found


@dataclass(frozen=True)
class Seen:
    """One output of one node: what was said of it, and what Cycles shows."""

    kind: str
    setting: str
    output: str
    named: bool
    differs: bool


def all_outputs(scene: Any) -> Iterator[tuple[str, str, str, Any]]:
    """A plane for each output of each node: its kind, setting, name and material."""
    side = HIGH // PLANE
    number = 0
    for kind in kinds():
        probe, _ = empty_material("probe")
        settings = [
            (name, len(list(value_outputs(n)))) for name, n in configured(probe.node_tree, kind)
        ]
        for which, (setting, count) in enumerate(settings):
            for index in range(count):
                material, surface = empty_material(f"{number:03d}")
                node = list(configured(material.node_tree, kind))[which][1]
                output = list(value_outputs(node))[index]
                light = node_in(material.node_tree, "ShaderNodeEmission", Color=output)
                material.node_tree.links.new(light.outputs[0], surface)
                row, column = divmod(number, side)
                assert row < side
                x, y = (TEXEL * PLANE * (k + 0.5) - 5.0 for k in (column, row))
                add_plane(scene, material.name, (x, y, 0.0), material, TEXEL * PLANE)
                number += 1
                yield kind, setting, output.name, material


# Of the second cameras' places, along both axes.
SHIFTS = (-1.25, 1.25)


def rolled(x: float, y: float) -> CachingCamera:
    """A camera that looks down with its picture's top toward -Y."""
    place = np.array([x, y, 3.75])
    return replace(
        camera_above((0, 0, 0), 3.75),
        world_from_camera=looking_at(place, place * (1, 1, 0), (0, -1, 0)),
        resolution=LOW,
    )


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> list[Seen]:
    scene = empty_scene()
    folder = tmp_path_factory.mktemp("views")
    outputs = list(all_outputs(scene))
    # From 3.75 high the texels of a picture of 48 on each side are as large as from 5 high those
    # of 64, so all cameras see the same points.
    cameras = [camera_above((0, 0, 0), 5.0), *(rolled(x, y) for x in SHIFTS for y in SHIFTS)]
    first, *others = (emission_of(scene, camera, folder) for camera in cameras)
    return [
        Seen(
            kind,
            setting,
            output,
            bool(effects_of(material)),
            _differs(number, first, others, cameras),
        )
        for number, (kind, setting, output, material) in enumerate(outputs)
    ]


def _differs(
    number: int, first: np.ndarray, others: list[np.ndarray], cameras: list[CachingCamera]
) -> bool:
    """Whether two cameras see another value where they see the same points of a plane."""
    row, column = (PLANE * k for k in divmod(number, HIGH // PLANE))
    for other, camera in zip(others, cameras[1:], strict=True):
        shift_x, shift_y = (round((5.0 - 3.75 + x) / TEXEL) for x in camera.origin[:2])
        low_row, low_column = row - shift_y, column - shift_x
        if not (0 <= low_row <= LOW - PLANE and 0 <= low_column <= LOW - PLANE):
            continue
        # Two texels away from the plane's edges and from the diagonal that splits it.
        here = [first[row + i, column + PLANE - 1 - i] for i in (1, 2)]
        # A rolled camera's picture stands on its head.
        upright = other[::-1, ::-1]
        there = [upright[low_row + i, low_column + PLANE - 1 - i] for i in (1, 2)]
        # Points differ by a few spacings of float32; Cycles' textures magnify that.
        return not np.allclose(here, there, rtol=1e-3, atol=1e-3)
    raise AssertionError(f"no second camera sees plane {number}")


def test_every_node_is_there(seen: list[Seen]) -> None:
    assert len({case.kind for case in seen}) > 60


def test_named_is_what_differs(seen: list[Seen]) -> None:
    wrong = [
        case
        for case in seen
        if case.named != case.differs and (case.kind, case.output) not in UNTESTABLE
    ]
    assert not wrong, "\n".join(map(str, wrong))
    assert sum(case.differs for case in seen) > 20
