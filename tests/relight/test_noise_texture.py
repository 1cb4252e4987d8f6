# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin of the noise against Blender's own Noise Texture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.reference.noise_texture import noise_texture


def blenders_noise(
    points: NDArray[np.float32], detail: float, roughness: float
) -> NDArray[np.float32]:
    """(N,) the Factor of Blender's node at (N, 3) points, by geometry nodes."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("points")
    mesh.from_pydata(points.tolist(), [], [])
    obj: Any = bpy.data.objects.new("points", mesh)
    bpy.context.scene.collection.objects.link(obj)
    tree: Any = bpy.data.node_groups.new("noise", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    store = tree.nodes.new("GeometryNodeStoreNamedAttribute")
    store.inputs["Name"].default_value = "noise"
    noise = tree.nodes.new("ShaderNodeTexNoise")
    for name, value in (("Scale", 1.0), ("Detail", detail), ("Roughness", roughness)):
        noise.inputs[name].default_value = value
    place = tree.nodes.new("GeometryNodeInputPosition")
    tree.links.new(place.outputs[0], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], store.inputs["Value"])
    tree.links.new(start.outputs[0], store.inputs["Geometry"])
    tree.links.new(store.outputs[0], end.inputs[0])
    obj.modifiers.new("noise", "NODES").node_group = tree
    depsgraph = bpy.context.evaluated_depsgraph_get()
    made: Any = obj.evaluated_get(depsgraph).to_mesh()
    values = np.empty(len(points), dtype=np.float32)
    made.attributes["noise"].data.foreach_get("value", values)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return values


@pytest.mark.parametrize(
    ("extent", "detail", "roughness"),
    [(10.0, 0.0, 0.5), (10.0, 3.6, 0.7), (1000.0, 2.0, 1.5), (3e5, 1.0, 0.5)],
)
def test_as_blender_has_it(extent: float, detail: float, roughness: float) -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-extent, extent, (500, 3)).astype(np.float32)
    got = blenders_noise(points, detail, roughness)
    want = noise_texture(points.astype(np.float64), detail, roughness)
    assert want.std() > 0.03
    # Both start from the same float32 places; the rest is rounding.
    np.testing.assert_allclose(got, want, atol=1e-6)
