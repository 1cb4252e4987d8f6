# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from typing import Any

import bpy
import pytest

import addon
from addon.ui import camera_watch
from addon.ui.engine import ENGINE
from addon.ui.panels import BUDGET_FIELDS
from tools.relume import parser


def listed_panels() -> set[str]:
    return {
        panel.__name__
        for panel in bpy.types.Panel.__subclasses__()
        if ENGINE in getattr(panel, "COMPAT_ENGINES", ())
    }


def test_registering_twice_in_a_row_leaves_nothing_behind() -> None:
    assert listed_panels() == set()
    for _ in range(2):
        addon.register()
        assert hasattr(bpy.types.Scene, "relume")
        assert bpy.ops.relume.bake.idname() == "RELUME_OT_bake"
        addon.unregister()
        assert not hasattr(bpy.types.Scene, "relume")
        assert not hasattr(bpy.types, "RELUME_PT_cache")
        assert listed_panels() == set()
    assert "_redraw_panels" not in [h.__name__ for h in bpy.app.handlers.depsgraph_update_post]


def test_the_panels_an_artist_needs_are_there(extension: None) -> None:
    listed = listed_panels()
    assert {
        "DATA_PT_context_light",
        "DATA_PT_EEVEE_light",
        "DATA_PT_spot",
        "DATA_PT_lens",
        "EEVEE_MATERIAL_PT_surface",
        "EEVEE_WORLD_PT_surface",
        "RENDER_PT_format",
        "RENDER_PT_color_management",
    } <= listed
    # Another engine's own settings mean nothing here.
    assert not {name for name in listed if name.startswith(("CYCLES_", "RENDER_PT_eevee"))}


def test_every_setting_explains_itself(extension: None) -> None:
    settings: Any = bpy.context.scene.relume
    names = {"cache_folder", "preset", "primaries", "secondaries"}
    names |= {"viewport_samples", "render_samples", "shadows", "frame_rate"}
    names |= {"shot", "budget", "max_pictures", "max_megabytes", "shot_share"}
    assert names <= set(settings.bl_rna.properties.keys())
    for name in names:
        assert len(settings.bl_rna.properties[name].description) > 20
    for name in ("shot", "budget", "preset", "frame_rate"):
        items = settings.bl_rna.properties[name].enum_items
        assert all(len(item.description) > 10 for item in items)
    assert set(BUDGET_FIELDS) == set(settings.bl_rna.properties["budget"].enum_items.keys())
    assert {name for fields in BUDGET_FIELDS.values() for name in fields} <= names
    assert settings.preset == "balanced"


def test_a_final_render_takes_as_many_samples_as_the_command_line(extension: None) -> None:
    words = ["relight", "room.blend", "--cache", "c", "--out", "a.exr"]
    scene: Any = bpy.context.scene
    assert parser().parse_args(words).samples == scene.relume.render_samples


def test_settings_are_kept_in_the_file(extension: None, tmp_path: Any) -> None:
    scene: Any = bpy.context.scene
    scene.relume.secondaries = 3
    path = str(tmp_path / "kept.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings()
    addon.unregister()
    addon.register()
    bpy.ops.wm.open_mainfile(filepath=path)
    scene = bpy.context.scene
    assert scene.relume.secondaries == 3


def test_panels_are_drawn_again_when_a_caching_camera_moves(
    extension: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[set[str]] = []
    monkeypatch.setattr(camera_watch, "redraw", drawn.append)
    bpy.data.objects["Cube"].location.x += 1.0
    bpy.context.view_layer.update()
    assert drawn == []
    bpy.data.objects["Camera"].location.x += 1.0
    bpy.context.view_layer.update()
    assert drawn == [{"PROPERTIES"}]
    bpy.data.objects["Camera"].data.lens = 20.0
    bpy.context.view_layer.update()
    assert len(drawn) == 2
