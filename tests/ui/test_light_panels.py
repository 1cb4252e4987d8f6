# SPDX-License-Identifier: GPL-3.0-or-later
"""The controls of lights: explained, noticed, undone, kept in the file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from addon.ui import light_panels
from addon.ui.engine import ENGINE

from .test_scene_changes import LIGHTS, changes_of


def groups() -> list[Any]:
    """Every property group of a light's controls."""
    controls: Any = bpy.data.objects["Light"].data.relume
    found = [controls, controls.blockers.add()]
    found += [
        getattr(controls, each.identifier)
        for each in controls.bl_rna.properties
        if each.type == "POINTER" and each.fixed_type.identifier.startswith("RELUME_PG_")
    ]
    return found


def test_every_control_explains_itself(extension: None) -> None:
    for group in groups():
        for declared in group.bl_rna.properties:
            if declared.identifier in ("name", "rna_type", "blockers", "active_blocker"):
                continue
            if declared.type == "POINTER" and declared.fixed_type.identifier.startswith("RELUME"):
                continue
            assert len(declared.description) > 20, declared.identifier
            assert declared.name != declared.identifier


def edits() -> dict[str, Callable[[], None]]:
    def light() -> Any:
        return bpy.data.objects["Light"].data.relume

    return {
        "float": lambda: setattr(light().barn_doors, "width", 0.3),
        "vector": lambda: setattr(light().shadow, "color", (0, 0, 1)),
        "enumeration": lambda: setattr(light().slide, "kind", "SLIDE"),
        "switch": lambda: setattr(light().noise, "use", True),
        "object": lambda: setattr(light().blockers.add(), "object", bpy.data.objects["Camera"]),
        "weight": lambda: setattr(light(), "specular", 0.5),
    }


@pytest.mark.parametrize("name", edits())
def test_an_edit_of_a_control_is_noticed(extension: None, name: str) -> None:
    found, key_changed = changes_of(edits()[name])
    # An object that a light points to for the first time is listed too.
    assert found | LIGHTS == found
    assert (found.geometry, found.world, found.materials, key_changed) == (False,) * 4


def test_a_moved_blocker_concerns_lights(extension: None) -> None:
    card = bpy.data.objects.new("Card", None)
    bpy.context.scene.collection.objects.link(card)
    move = lambda: setattr(card, "location", np.array(card.location) + 1.0)  # noqa: E731
    assert not changes_of(move)[0].lights
    bpy.data.objects["Light"].data.relume.blockers.add().object = card
    assert changes_of(move)[0].lights


def test_controls_are_kept_in_the_file(extension: None, tmp_path: Any) -> None:
    light: Any = bpy.data.objects["Light"].data
    light.relume.barn_doors.width = 0.125
    path = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings()
    bpy.ops.wm.open_mainfile(filepath=path)
    light = bpy.data.objects["Light"].data
    assert light.relume.barn_doors.width == 0.125


def in_light_tab(operator: Any) -> Any:
    obj = bpy.data.objects["Light"]
    with bpy.context.temp_override(light=obj.data, object=obj):
        return operator()


def test_blockers_are_added_and_taken_out(extension: None) -> None:
    light: Any = bpy.data.objects["Light"]
    assert in_light_tab(bpy.ops.relume.add_blocker) == {"FINISHED"}
    assert in_light_tab(bpy.ops.relume.add_blocker) == {"FINISHED"}
    first, second = (item.object for item in light.data.relume.blockers)
    assert first.name in bpy.context.scene.objects
    assert light.data.relume.active_blocker == 1
    bpy.context.view_layer.update()
    axis = light.matrix_world.to_3x3().col[2].normalized()
    before = np.array(light.matrix_world.translation) - np.array(axis)
    np.testing.assert_allclose(np.array(second.matrix_world.translation), before, atol=1e-5)
    found, _ = changes_of(lambda: in_light_tab(bpy.ops.relume.remove_blocker))
    assert found.lights
    assert [item.object for item in light.data.relume.blockers] == [first]
    in_light_tab(bpy.ops.relume.remove_blocker)
    assert in_light_tab(bpy.ops.relume.remove_blocker) == {"CANCELLED"}
    assert second.name in bpy.data.objects
    assert "UNDO" in light_panels.RELUME_OT_add_blocker.bl_options


class Recorder:
    """A layout that remembers what is drawn into it."""

    def __init__(self, shown: list[tuple[Any, str]]) -> None:
        self.shown = shown

    def prop(self, group: Any, name: str, **_: Any) -> None:
        self.shown.append((type(group).__name__, name))
        getattr(group, name)

    def template_ID(self, group: Any, name: str, **_: Any) -> None:  # noqa: N802
        self.prop(group, name)

    def template_list(self, *_: Any, **__: Any) -> None:
        self.shown.append(("list", ""))

    def operator(self, *_: Any, **__: Any) -> None:
        """Nothing to remember."""

    def row(self, **_: Any) -> Recorder:
        return Recorder(self.shown)

    column = row


def test_panels_show_every_control(extension: None) -> None:
    """Drawn into a stand-in, as there is no window."""
    from types import SimpleNamespace

    light: Any = bpy.data.objects["Light"].data
    in_light_tab(bpy.ops.relume.add_blocker)
    shown: list[tuple[Any, str]] = []
    context = SimpleNamespace(light=light, engine=ENGINE)
    for cls in light_panels.CLASSES:
        if not issubclass(cls, bpy.types.Panel):
            continue
        assert cls.poll(context)
        assert cls.bl_parent_id == "RELUME_PT_light"
        panel = SimpleNamespace(
            layout=Recorder(shown), group=cls.group,
            draw_group=lambda *a, cls=cls: cls.draw_group(None, *a),
        )  # fmt: skip
        drawn: Any = panel
        cls.draw_header(drawn, context)
        cls.draw(drawn, context)
    names = {name for _, name in shown}
    wanted = {
        declared.identifier
        for group in groups()
        for declared in group.bl_rna.properties
        if declared.type != "POINTER" or declared.fixed_type.identifier in ("Image", "Object")
    }
    assert wanted - {"name", "blockers", "active_blocker"} <= names
