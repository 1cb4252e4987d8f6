# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours are no means where a texel shows through holes that are finer than it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from .material_grid import add_plane, bake, camera_above, empty_material, empty_scene, node_in


def baked(folder: Path, *, has_other: bool) -> dict[str, NDArray[np.float32]]:
    """A sieve of two greys before nothing; another material out of sight, if asked for."""
    scene = empty_scene()
    material, surface = empty_material("sieve")
    tree: Any = material.node_tree
    greys = node_in(
        tree, "ShaderNodeTexChecker", Scale=3.0, Color1=(0.5, 0.5, 0.5), Color2=(0.6, 0.6, 0.6)
    )
    place = node_in(tree, "ShaderNodeNewGeometry").outputs["Position"]
    noise = node_in(tree, "ShaderNodeTexNoise", Scale=90.0, Vector=place)
    there = tree.nodes.new("ShaderNodeMath")
    there.operation = "GREATER_THAN"
    tree.links.new(noise.outputs[0], there.inputs[0])
    there.inputs[1].default_value = 0.42
    mixed = node_in(tree, "ShaderNodeMixShader", Fac=there.outputs[0])
    clear = node_in(tree, "ShaderNodeBsdfTransparent")
    diffuse = node_in(tree, "ShaderNodeBsdfDiffuse", Color=greys.outputs["Color"])
    for number, shader in ((1, clear), (2, diffuse)):
        tree.links.new(shader.outputs[0], mixed.inputs[number])
    tree.links.new(mixed.outputs[0], surface)
    add_plane(scene, "plane", (0.0, 0.0, 0.0), material, size=4.0)
    if has_other:
        other, end = empty_material("other")
        black = node_in(other.node_tree, "ShaderNodeBsdfDiffuse", Color=(0.0, 0.0, 0.0))
        other.node_tree.links.new(black.outputs[0], end)
        add_plane(scene, "far away", (30.0, 0.0, -1.0), other, size=0.1)
    store, _ = bake(scene, [camera_above((0, 0, 0), 2.0, 1.4)], folder, preset="final")
    return store.read_camera(0).channels


@pytest.mark.parametrize("has_other", [False, True])
def test_what_is_seen_through_holes_is_no_part_of_a_colour(tmp_path: Path, has_other: bool) -> None:
    channels = baked(tmp_path, has_other=has_other)
    assert ("material_id" in channels) == has_other
    hit = channels["depth"][..., 0] > 0.0
    assert 0.7 < hit.mean() < 0.95
    # What sharpening adds at the edges between the greys, an eighth of 0.1, is less than 0.02.
    colour = channels["diffuse_color"][hit]
    assert colour.min() > 0.48
    assert colour.max() < 0.62
