# SPDX-License-Identifier: GPL-3.0-or-later
"""What Relume keeps in the .blend, as scene.relume."""

from __future__ import annotations

import bpy

from ..caching.presets import DEFAULT_PRESET, PRESETS
from ..sampling import PICTURE_SAMPLES

# Blender keeps no strings of its own for an enumeration's items: they must outlive it here.
_PRESET_ITEMS = tuple((name, name.capitalize(), fine.note) for name, fine in PRESETS.items())


class RELUME_PG_settings(bpy.types.PropertyGroup):
    """One scene's settings. Blender makes the properties from the annotations."""

    __annotations__ = {
        "cache_folder": bpy.props.StringProperty(
            name="Cache Folder",
            description="Where the baked pictures are kept. Empty: beside the .blend, "
            "under its name with '.relume' at the end",
            subtype="DIR_PATH",
            options={"PATH_SUPPORTS_BLEND_RELATIVE"},
        ),
        "preset": bpy.props.EnumProperty(
            name="Preset",
            description="How large the caching cameras' pictures may be",
            items=_PRESET_ITEMS,
            default=DEFAULT_PRESET,
        ),
        "primaries": bpy.props.IntProperty(
            name="Primary Cameras",
            description="Most cube cameras, six pictures each, at the centres of the largest "
            "empty spheres. More of them cover scenes of several rooms",
            default=1,
            min=0,
            soft_max=8,
        ),
        "secondaries": bpy.props.IntProperty(
            name="Secondary Cameras",
            description="Most single cameras, put where they see what the cube cameras miss",
            default=8,
            min=0,
            soft_max=64,
        ),
        "viewport_samples": bpy.props.IntProperty(
            name="Viewport Samples",
            description="Pictures drawn one after the other and averaged while the view stands "
            "still: soft shadows and edges grow smooth",
            default=PICTURE_SAMPLES,
            min=1,
            soft_max=256,
        ),
        "render_samples": bpy.props.IntProperty(
            name="Render Samples",
            description="Pictures drawn and averaged for a final render",
            default=PICTURE_SAMPLES,
            min=1,
            soft_max=1024,
        ),
    }


def register() -> None:
    """Give every scene its settings."""
    bpy.utils.register_class(RELUME_PG_settings)
    bpy.types.Scene.relume = bpy.props.PointerProperty(type=RELUME_PG_settings)


def unregister() -> None:
    """Take them away again; what a .blend saved of them stays in it."""
    del bpy.types.Scene.relume
    bpy.utils.unregister_class(RELUME_PG_settings)
