# SPDX-License-Identifier: GPL-3.0-or-later
"""The papers' reflection models, chosen for a material."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from addon.caching.channels import Distribution
from addon.caching.fingerprint import scene_fingerprint
from addon.caching.material_model import MODEL_NAMES, material_model
from addon.ui import properties

from .material_grid import (
    HALF,
    add_plane,
    at,
    bake,
    camera_above,
    empty_material,
    empty_scene,
    geometry_of_scene,
    node_in,
)

BASE = np.array([0.6, 0.3, 0.1])
F0 = 0.04


@pytest.fixture
def registered() -> Iterator[None]:
    properties.register()
    yield
    properties.unregister()


def plastic(name: str) -> Any:
    material, surface = empty_material(name)
    node = node_in(
        material.node_tree, "ShaderNodeBsdfPrincipled", Base_Color=tuple(BASE), Roughness=0.3
    )
    material.node_tree.links.new(node.outputs[0], surface)
    return material


EXPECTED: dict[str, dict[str, Any]] = {
    "CYCLES": {"specular_f0": F0, "specular_f90": 1.0, "layer_f90": 1.0, "distribution": 0.0},
    "LAMBERT": {"specular_f90": 0.0, "layer_f90": 0.0, "diffuse_roughness": 0.0},
    "PHONG": {"specular_f0": F0, "specular_f90": F0, "distribution": Distribution.PHONG},
    "BLINN": {"specular_f0": F0, "specular_f90": F0, "distribution": Distribution.BLINN},
    "OREN_NAYAR": {"specular_f90": 0.0, "diffuse_roughness": 0.3, "diffuse_model": 0.0},
    "COOK_TORRANCE": {
        "specular_f0": F0, "specular_f90": 1.0, "distribution": Distribution.COOK_TORRANCE,
    },
    "MINNAERT": {"specular_f90": 0.0, "diffuse_roughness": 1.5, "diffuse_model": 1.0},
}  # fmt: skip


def test_each_model_is_cached_as_its_lobe(registered: None, tmp_path: Path) -> None:
    scene = empty_scene()
    for column, name in enumerate(MODEL_NAMES):
        material = plastic(name)
        material.relume.model = name
        material.relume.limb = 1.5
        add_plane(scene, name, (1.25 * column - 3.75, 0.0, 0.0), material)
    store, report = bake(scene, [camera_above((0, 0, 0), 5.0)], tmp_path)
    framebuffer = store.read_camera(0)
    for column, name in enumerate(MODEL_NAMES):
        place = (1.25 * column - 3.75, 0.0, 0.0)
        for channel, value in ({"diffuse_color": BASE} | EXPECTED[name]).items():
            found = at(framebuffer, store, channel, place)
            assert found == pytest.approx(np.broadcast_to(value, found.shape), rel=2 * HALF), name
        said = [text for text in report.approximations if f"'{name}'" in text]
        assert bool(said) == (name != "CYCLES")


def test_the_choice_is_in_the_file_without_the_extension(registered: None, tmp_path: Path) -> None:
    """As the command line reads it; and it changes the material's fingerprint."""
    scene = empty_scene()
    material = plastic("plastic")
    add_plane(scene, "plane", (0.0, 0.0, 0.0), material)
    before = scene_fingerprint(geometry_of_scene(scene))
    material.relume.model, material.relume.limb = "MINNAERT", 0.75
    assert scene_fingerprint(geometry_of_scene(scene)) != before
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "kept.blend"))
    properties.unregister()
    try:
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "kept.blend"))
        kept: Any = bpy.data.materials["plastic"]
        assert not hasattr(kept, "relume")
        assert material_model(kept) == ("MINNAERT", 0.75)
        assert material_model(bpy.data.materials.new("fresh")) == ("CYCLES", 1.0)
    finally:
        properties.register()
