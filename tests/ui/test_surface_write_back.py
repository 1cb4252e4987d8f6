# SPDX-License-Identifier: GPL-3.0-or-later
"""Applying an edit to nodes: what is refused leaves the nodes alone. What it looks like is in
tests/relight/test_surface_edits_against_cycles.py."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import pytest

from addon.errors import InputError
from addon.scene.surface_edit import SurfaceEdit
from addon.scene.tree_lines_reader import tree_lines
from addon.ui.surface_write_back import apply_edit

ALL = SurfaceEdit(gain=0.5, roughness=2.0, specular=0.5, emission=2.0)


def material() -> Any:
    return bpy.data.materials["Material"]


def node() -> Any:
    return material().node_tree.nodes["Principled BSDF"]


def instead(kind: str, **attributes: Any) -> Any:
    """Another shader in the place of the Principled BSDF."""
    tree = material().node_tree
    made = tree.nodes.new(kind)
    for name, value in attributes.items():
        setattr(made, name, value)
    tree.links.new(made.outputs[0], tree.nodes["Material Output"].inputs[0])
    return made


def conductor() -> None:
    instead("ShaderNodeBsdfMetallic", fresnel_type="PHYSICAL_CONDUCTOR")


@pytest.mark.parametrize(
    ("prepare", "edit", "says"),
    [
        (lambda: setattr(node().inputs["Metallic"], "default_value", 0.5), ALL, "metal has no"),
        (lambda: node().inputs["Base Color"].keyframe_insert("default_value"), ALL, "animated"),
        (lambda: instead("ShaderNodeBsdfGlass"), ALL, "not understood"),
        (conductor, ALL, "has no colour"),
        (lambda: instead("ShaderNodeBsdfAnisotropic"), SurfaceEdit(specular=2.0), "raised"),
    ],
)
def test_what_has_no_input_is_refused(
    extension: None, prepare: Callable[[], Any], edit: SurfaceEdit, says: str
) -> None:
    prepare()
    before = list(tree_lines(material().node_tree))
    with pytest.raises(InputError, match=says):
        apply_edit(material(), edit)
    assert list(tree_lines(material().node_tree)) == before


def test_the_operator_applies_and_resets(extension: None) -> None:
    material().relume_edit.gain = 0.5
    material().relume_edit.roughness_offset = 0.25
    color, roughness = (node().inputs[name] for name in ("Base Color", "Roughness"))
    before = tuple(color.default_value)
    assert bpy.ops.relume.apply_surface_edit() == {"FINISHED"}
    assert tuple(color.default_value)[:3] == pytest.approx([0.5 * value for value in before[:3]])
    assert color.default_value[3] == before[3]
    assert roughness.default_value == pytest.approx(0.75)
    assert material().relume_edit.gain == 1.0
    assert material().relume_edit.roughness_offset == 0.0


def test_a_refusal_keeps_the_edit(extension: None) -> None:
    instead("ShaderNodeBsdfGlass")
    material().relume_edit.gain = 0.5
    with pytest.raises(RuntimeError, match="not understood"):
        bpy.ops.relume.apply_surface_edit()
    assert material().relume_edit.gain == 0.5
