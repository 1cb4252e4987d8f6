# SPDX-License-Identifier: GPL-3.0-or-later
"""What Relume keeps in the .blend, as scene.relume, camera.relume and material.relume.

light_properties has what lights have.
"""

from __future__ import annotations

import bpy

from ..caching.material_model import DEFAULT_LIMB, MODELS
from ..caching.presets import DEFAULT_PRESET, PRESETS
from ..camplace.settings import RESOLUTIONS, PlacementSettings
from ..sampling import PICTURE_SAMPLES
from ..scene.box_reader import BOX_TYPES
from . import light_properties

# Blender keeps no strings of its own for an enumeration's items: they must outlive it here.
_PRESET_ITEMS = tuple((name, name.capitalize(), fine.note) for name, fine in PRESETS.items())
_SHOT_ITEMS = (
    (
        "ALL",
        "All Cameras",
        (
            "Every camera of the scene where it is now, and the active one along its way "
            "through the frame range"
        ),
    ),
    (
        "ACTIVE",
        "Active Camera",
        (
            "The active camera along its way through the frame range. Where timeline markers bind "
            "cameras: each over the frames in which it is active"
        ),
    ),
)
_BUDGET_ITEMS = (
    ("CAMERAS", "Cameras", "So many cube cameras and so many single ones"),
    (
        "PICTURES",
        "Pictures",
        (
            "So many pictures, faces of cube cameras or single ones, whichever see more. Few of "
            "them make a relight fast"
        ),
    ),
    (
        "MEMORY",
        "Memory",
        "As many pictures, large or small, as take so much memory, whichever show more",
    ),
)
_SHADOW_ITEMS = (
    ("AUTO", "Automatic", "Shadow maps where there is a GPU, else traced rays"),
    ("MAP", "Shadow Maps", "Fast on a GPU: what each light sees is drawn, and looked up"),
    (
        "TRACED",
        "Ray Traced",
        "Exact: a ray for each pixel, light and sample. Contacts and thin parts are as in Cycles",
    ),
)
# Seconds for a picture of a moving view; 0 for as long as it takes.
_PICTURE_SECONDS = {"60": 0.016, "30": 0.033, "20": 0.050, "FULL": 0.0}
_FRAME_RATE_ITEMS = (
    ("60", "60 fps", "At most 16 ms for a picture: the smoothest way round, and the coarsest"),
    ("30", "30 fps", "At most 33 ms for a picture"),
    ("20", "20 fps", "At most 50 ms for a picture"),
    ("FULL", "Full Resolution", "Every pixel of every picture, however long one takes"),
)
_DEFAULT = PlacementSettings()
_RESOLUTION_ITEMS = tuple((str(tier), f"{tier} x {tier}", "") for tier in RESOLUTIONS)


def _bounds_a_box(settings: bpy.types.PropertyGroup, obj: bpy.types.Object) -> bool:
    """Whether the artist may pick an object as the box of interest."""
    return obj.type in BOX_TYPES and settings.id_data.objects.get(obj.name) == obj


class RELUME_PG_camera(bpy.types.PropertyGroup):
    """What a caching camera has that Blender's cameras lack."""

    __annotations__ = {
        "resolution": bpy.props.EnumProperty(
            name="Resolution",
            description="Texels along each side of what is baked from this camera. "
            "The preset may allow fewer",
            items=_RESOLUTION_ITEMS,
            default=_RESOLUTION_ITEMS[-1][0],
        ),
    }


class RELUME_PG_material(bpy.types.PropertyGroup):
    """What a material has that Blender's materials lack."""

    __annotations__ = {
        "model": bpy.props.EnumProperty(
            name="Reflection",
            description="The model that Relume shades this material with. Other models than "
            "Cycles' own are not in Cycles' renders",
            items=MODELS,
            default=MODELS[0][0],
        ),
        "limb": bpy.props.FloatProperty(
            name="Limb",
            description="Minnaert's exponent: 1 is Lambert's model, less is brighter toward the "
            "outline, more is darker there",
            default=DEFAULT_LIMB,
            min=0.0,
            soft_min=0.5,
            max=8.0,
            soft_max=2.0,
        ),
    }


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
        "shot": bpy.props.EnumProperty(
            name="Shot",
            description="Whose views caching cameras are placed for. What is baked serves every "
            "camera; a view that nothing was placed for may have more holes",
            items=_SHOT_ITEMS,
            default="ALL",
        ),
        "budget": bpy.props.EnumProperty(
            name="Budget",
            description="What bounds how many caching cameras Place puts. It is kept exactly; "
            "Place puts fewer where more would add nearly nothing",
            items=_BUDGET_ITEMS,
            default="CAMERAS",
        ),
        "primaries": bpy.props.IntProperty(
            name="Primary Cameras",
            description="Most cube cameras, six pictures each, at the centres of the largest "
            "empty spheres. More of them cover scenes of several rooms",
            default=_DEFAULT.primaries,
            min=0,
            soft_max=8,
        ),
        "secondaries": bpy.props.IntProperty(
            name="Secondary Cameras",
            description="Most single cameras, put where they see what the cube cameras miss",
            default=_DEFAULT.secondaries,
            min=0,
            soft_max=64,
        ),
        "max_pictures": bpy.props.IntProperty(
            name="Pictures",
            description="Most pictures to bake. A cube camera takes one for each face that sees "
            "something, six at most",
            default=6 * _DEFAULT.primaries + _DEFAULT.secondaries,
            min=1,
            soft_max=128,
        ),
        "max_megabytes": bpy.props.IntProperty(
            name="Megabytes",
            description="Most memory that the pictures may take when a preset does not make them "
            f"smaller: {_DEFAULT.bytes_per_texel:g} bytes a texel, which is all channels. Simple "
            "materials need fewer, and the files are compressed",
            default=500,
            min=4,
            soft_max=8000,
        ),
        "shot_share": bpy.props.FloatProperty(
            name="Shot Share",
            description="How much the surfaces that the shot sees count when cameras are placed, "
            "against all other surfaces of the set. 1: only what the shot sees, sharply. Less: "
            "more of the set is baked, for views that are yet to be found",
            default=_DEFAULT.view_share,
            min=0.0,
            max=1.0,
            subtype="FACTOR",
        ),
        "box_object": bpy.props.PointerProperty(
            name="Box of Interest",
            description="Cameras are placed for what lies in this object's bounds: an empty, drawn "
            "as a cube, or a mesh. Without one, for what the scene's cameras see",
            type=bpy.types.Object,
            poll=_bounds_a_box,
        ),
        "keep_cameras": bpy.props.BoolProperty(
            name="Keep Cameras",
            description="Place starts from the cameras that there are, as you edited them, and "
            "keeps those that still serve: what is baked of them stays current",
            default=True,
        ),
        "active_light": bpy.props.IntProperty(name="Active Light"),
        "mute_world": bpy.props.BoolProperty(
            name="Mute World", description="Leave the world's light out of Relume's pictures"
        ),
        "mute_emission": bpy.props.BoolProperty(
            name="Mute Emission",
            description="Leave what surfaces send out by themselves, and its light, out of "
            "Relume's pictures",
        ),
        "light_passes": bpy.props.BoolProperty(
            name="Light Passes",
            description="Give the compositor, and multi-layer files, a render pass for each light",
        ),
        "viewport_samples": bpy.props.IntProperty(
            name="Viewport Samples",
            description="Pictures drawn one after the other and averaged while the view stands "
            "still: soft shadows and edges grow smooth",
            default=PICTURE_SAMPLES,
            min=1,
            soft_max=256,
        ),
        "frame_rate": bpy.props.EnumProperty(
            name="Frame Rate",
            description="How often the picture is to be drawn while the view moves. It has a lower "
            "resolution then if it needs to; once the view stands still, it gets all its pixels, "
            "and is anti-aliased",
            items=_FRAME_RATE_ITEMS,
            default="30",
        ),
        "fill_holes": bpy.props.BoolProperty(
            name="Fill Holes",
            description="Have Cycles bake what no caching camera sees of a view: in the background "
            "once a viewport stands still, and before a final render. Until then it is shown with "
            "its materials' mean values",
            default=True,
        ),
        "sharpen_views": bpy.props.BoolProperty(
            name="Sharpen Views",
            description="With the holes, have Cycles bake what the caching cameras show too "
            "coarsely for a view: with less than one of their texels to a pixel, since it is "
            "nearer than they are",
        ),
        "show_confidence": bpy.props.BoolProperty(
            name="Show Confidence",
            description="Lay a heat map over the viewport: red where the picture is not to be "
            "trusted, since the cache shows that place badly or not at all; blue where it is",
        ),
        "shadows": bpy.props.EnumProperty(
            name="Shadows",
            description="How shadows are found",
            items=_SHADOW_ITEMS,
            default="AUTO",
        ),
        "render_samples": bpy.props.IntProperty(
            name="Render Samples",
            description="Pictures drawn and averaged for a final render",
            default=PICTURE_SAMPLES,
            min=1,
            soft_max=1024,
        ),
    }


def picture_seconds(scene: bpy.types.Scene) -> float:
    """What a picture of a moving view may take; 0 for as long as it takes."""
    return _PICTURE_SECONDS[scene.relume.frame_rate]


_register_classes, _unregister_classes = bpy.utils.register_classes_factory(
    (RELUME_PG_camera, RELUME_PG_material, RELUME_PG_settings)
)


def register() -> None:
    """Give every scene, camera and material its settings."""
    _register_classes()
    bpy.types.Camera.relume = bpy.props.PointerProperty(type=RELUME_PG_camera)
    bpy.types.Material.relume = bpy.props.PointerProperty(type=RELUME_PG_material)
    bpy.types.Scene.relume = bpy.props.PointerProperty(type=RELUME_PG_settings)
    light_properties.register()


def unregister() -> None:
    """Take them away again; what a .blend saved of them stays in it."""
    light_properties.unregister()
    del bpy.types.Scene.relume
    del bpy.types.Material.relume
    del bpy.types.Camera.relume
    _unregister_classes()
