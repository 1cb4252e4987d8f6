# SPDX-License-Identifier: GPL-3.0-or-later
"""What Relume follows of ray visibility is offered, and nothing else; and it is followed."""

from __future__ import annotations

from typing import Any

import bpy

from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.light_reader import read_lights
from addon.ui.visibility_panel import followed


def test_offered_where_it_counts(extension: None) -> None:
    found = {obj.name: [name for name, _ in followed(obj)] for obj in bpy.data.objects}
    assert found == {
        "Cube": ["visible_camera", "visible_shadow"],
        "Light": ["visible_diffuse", "visible_glossy"],
        "Camera": [],
    }
    empty: Any = bpy.data.objects.new("Group", None)
    assert not followed(empty)
    empty.instance_type = "COLLECTION"
    assert followed(empty)


def test_each_is_followed(extension: None) -> None:
    scene = bpy.context.scene
    cube, lamp = bpy.data.objects["Cube"], bpy.data.objects["Light"]

    def state() -> tuple[bool, ...]:
        geometry = with_render_depsgraph(scene, read_geometry)
        (light,) = with_render_depsgraph(scene, read_lights)
        shown, casts = geometry.camera_visible.all(), geometry.shadow_visible.all()
        return bool(shown), bool(casts), light.diffuse_factor == 1.0, light.specular_factor == 1.0

    assert state() == (True, True, True, True)
    every = [(obj, name) for obj in (cube, lamp) for name, _ in followed(obj)]
    for number, (obj, name) in enumerate(every):
        setattr(obj, name, False)
        assert state() == tuple(k != number for k in range(4)), name
        setattr(obj, name, True)


def test_blenders_panel_is_given_back(extension: None) -> None:
    drawn: Any = bpy.types.OBJECT_PT_visibility.draw
    assert [f.__module__ for f in drawn._draw_funcs[1:]] == ["addon.ui.visibility_panel"]
    import addon

    addon.unregister()
    assert len(drawn._draw_funcs) == 1
    addon.register()
