# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist has set for Cycles' own renders changes nothing of what is baked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

from .material_grid import add_plane, bake, camera_above, empty_material, empty_scene, node_in

SETTINGS: tuple[dict[str, Any], ...] = (
    {"samples": 3, "use_layer_samples": "IGNORE"},
    {"samples": 1, "use_layer_samples": "BOUNDED"},
    {"use_sample_subset": True, "sample_offset": 5, "sample_subset_length": 3},
    {"film_exposure": 0.5, "diffuse_bounces": 0},
    {"sample_clamp_direct": 0.1, "sample_clamp_indirect": 0.2},
)


def baked(
    folder: Path, *, first_layer: bool = True, **settings: Any
) -> dict[str, NDArray[np.float32]]:
    """A fine chequered floor with holes below a roof, under a white sky."""
    scene = empty_scene()
    world = scene.world = bpy.data.worlds.new("sky")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    material, surface = empty_material("tiles")
    tree = material.node_tree
    colour = node_in(tree, "ShaderNodeTexChecker", Scale=37.3).outputs["Color"]
    diffuse = node_in(tree, "ShaderNodeBsdfDiffuse", Color=colour)
    clear = node_in(tree, "ShaderNodeBsdfTransparent")
    holes = node_in(tree, "ShaderNodeTexChecker", Scale=3.0).outputs["Fac"]
    mixed = node_in(tree, "ShaderNodeMixShader", Fac=holes)
    tree.links.new(clear.outputs[0], mixed.inputs[1])
    tree.links.new(diffuse.outputs[0], mixed.inputs[2])
    tree.links.new(mixed.outputs[0], surface)
    add_plane(scene, "floor", (0.0, 0.0, 0.0), material, size=20.0)
    add_plane(scene, "roof", (1.5, 0.0, 1.0), material).rotation_euler = (0.3, 0.4, 0.0)
    for name, value in settings.items():
        setattr(scene.cycles, name, value)
    if not first_layer:
        scene.view_layers.new("second")
        scene.view_layers[0].use = False
    store, _ = bake(scene, [camera_above((0, 0, 0), 2.0, 1.4)], folder, preset="balanced")
    for name, value in settings.items():
        assert getattr(scene.cycles, name) == pytest.approx(value)
    return store.read_camera(0).channels


def test_nothing_that_is_baked_follows_them(tmp_path: Path) -> None:
    plain = baked(tmp_path / "plain")
    assert plain["diffuse_color"].mean() > 0.3
    assert plain["ambient_occlusion"].min() < 0.95
    for number, settings in enumerate(SETTINGS):
        other = baked(tmp_path / str(number), **settings)
        assert other.keys() == plain.keys()
        for name, values in plain.items():
            assert np.array_equal(other[name], values), (settings, name)


def test_another_view_layer_than_the_first_is_baked(tmp_path: Path) -> None:
    plain = baked(tmp_path / "plain")
    other = baked(tmp_path / "second", first_layer=False)
    for name, values in plain.items():
        assert np.array_equal(other[name], values), name
