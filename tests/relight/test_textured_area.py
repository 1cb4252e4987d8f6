# SPDX-License-Identifier: GPL-3.0-or-later
"""Area lights whose nodes put a picture on them, against Cycles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.relight.light_points.light_sample import light_sample
from tests.cycles_stage import CyclesStage
from tests.reference.surfaces import surfaces

from .drawing import drawn_light

pytestmark = pytest.mark.usefixtures("gpu_context")
SAMPLES = 64


def picture_by_uv(tree: Any) -> None:
    """Red to the right, green upwards, a blue corner."""
    import bpy

    image = bpy.data.images.new("Softbox", 16, 16, float_buffer=True, is_data=True)
    y, x = np.mgrid[0:16, 0:16] / 15.0
    rgba = np.stack([x, y**2, (x < 0.3) * (y < 0.3), np.ones_like(x)], axis=-1)
    image.pixels.foreach_set(rgba.astype(np.float32).ravel())
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.links.new(texture.outputs["Color"], tree.nodes["Emission"].inputs["Color"])


def place_in_world(tree: Any) -> None:
    geometry, scale = (
        tree.nodes.new("ShaderNodeNewGeometry"),
        tree.nodes.new("ShaderNodeVectorMath"),
    )
    scale.operation = "MULTIPLY_ADD"
    scale.inputs[1].default_value, scale.inputs[2].default_value = (0.4,) * 3, (0.4, 0.5, -0.4)
    tree.links.new(geometry.outputs["Position"], scale.inputs[0])
    tree.links.new(scale.outputs[0], tree.nodes["Emission"].inputs["Color"])


@pytest.mark.parametrize(
    ("shape", "build", "scale"),
    [
        ("RECTANGLE", picture_by_uv, (1.0, 1.0, 1.0)),
        ("ELLIPSE", picture_by_uv, (-1.0, 1.5, 1.0)),
        ("RECTANGLE", place_in_world, (-1.0, 1.5, 1.0)),
    ],
)
def test_a_textured_area_light(shape: str, build: Any, scale: Any, tmp_path: Path) -> None:
    """40 dB: what is left is Cycles' noise, and 64 points that stand for the light."""
    from tests.scene.test_light_nodes import read

    stage = CyclesStage("AREA", tmp_path, 48)
    data = stage.light.data
    data.shape, data.size, data.size_y = shape, 1.6, 0.9
    stage.light.location.z, stage.light.scale = 1.6, scale
    plain = stage.render(16)[0]
    build(data.node_tree)
    shown, position, normal = stage.render(256)
    light = read(stage.scene)
    assert light.warnings == ()
    assert light.profile is not None
    assert light.profile.over_area is not None
    hit = stage.objects > 0
    place = np.where(hit[..., None], position, (0.0, 0.0, -1.0))
    facing = np.where(hit[..., None], normal, (0.0, 0.0, 1.0))
    facing /= np.linalg.norm(facing, axis=-1, keepdims=True)
    surface = surfaces(place, facing, eye=(0.0, 0.0, 0.0), albedo=1.0)
    surface = replace(surface, eye=np.array([0.0, -3.5, 4.0]), perspective=True)
    samples = [light_sample(light, k, SAMPLES) for k in range(SAMPLES)]
    relit = drawn_light(surface, light, samples)[..., :3]
    # Where a surface is seen from its front, by a light that reaches it from there.
    error = np.sqrt(np.mean((relit - shown)[hit] ** 2)) / shown.max()
    assert error < 10.0 ** (-40.0 / 20.0)
    # One sample, as of a preview, is the mean of all places.
    first = drawn_light(surface, light, [light_sample(light, 0, 1)])[..., :3]
    y, x = (np.mgrid[0:64, 0:64] + 0.5) / 64.0 - 0.5
    on_light = np.hypot(x, y) <= 0.5 if shape == "ELLIPSE" else np.ones(x.shape, dtype=bool)
    mean = light.profile.over_area[on_light].mean(axis=0)
    bare = drawn_light(surface, replace(light, profile=None), [light_sample(light, 0, 1)])[..., :3]
    np.testing.assert_allclose(first, bare * mean, rtol=1e-4, atol=1e-6)
    assert np.abs(shown - plain).max() > 0.2 * plain.max()
