# SPDX-License-Identifier: GPL-3.0-or-later
"""The cinematographer's controls as Blender keeps them: `light.relume`.

The command line registers these alone, so that it reads and edits what artists set.
"""

from __future__ import annotations

from typing import Any

import bpy

# Blender keeps no strings of its own for an enumeration's items: they must outlive it here.
_SLIDE_KINDS = (
    ("COOKIE", "Cookie", "Bright parts of the image let the light through, dark ones hold it"),
    ("SLIDE", "Slide", "The image colours the light, as a projector does"),
)

# Metres; beyond, float32 would hold no detail.
_FARTHEST = 1e6


def _changed(group: Any, _context: Any) -> None:
    """Blender does not tell its evaluated scene of edits of properties like these."""
    group.id_data.update_tag()


def _float(name: str, description: str, default: float = 0.0, **more: Any) -> Any:
    more = {"min": 0.0, "max": _FARTHEST, **more}
    return bpy.props.FloatProperty(
        name=name, description=description, default=default, update=_changed, **more
    )


def _length(name: str, description: str, default: float = 0.0, **more: Any) -> Any:
    return _float(name, description, default, subtype="DISTANCE", **more)


def _factor(name: str, description: str, default: float = 1.0) -> Any:
    return _float(name, description, default, max=1.0, subtype="FACTOR")


def _bool(name: str, description: str, default: bool = False) -> Any:
    return bpy.props.BoolProperty(
        name=name, description=description, default=default, update=_changed
    )


def _vector(name: str, description: str, default: tuple[float, ...], **more: Any) -> Any:
    more = {"min": -_FARTHEST, "max": _FARTHEST, **more}
    return bpy.props.FloatVectorProperty(
        name=name, description=description, default=default, size=len(default), update=_changed,
        **more,
    )  # fmt: skip


def _turn(name: str, description: str) -> Any:
    return _float(name, description, min=-_FARTHEST, subtype="ANGLE")


def _outline(where: str, size: float) -> dict[str, Any]:
    """The properties of a soft superellipse."""
    return {
        "width": _length("Width", f"Half of its width{where}", size, soft_max=10.0),
        "height": _length("Height", f"Half of its height{where}", size, soft_max=10.0),
        "width_edge": _length(
            "Edge X",
            "How much further out, to the sides, its soft edge ends. 0 is a hard edge",
            soft_max=10.0,
        ),
        "height_edge": _length(
            "Edge Y",
            "How much further out, up and down, its soft edge ends. 0 is a hard edge",
            soft_max=10.0,
        ),
        "roundness": _float(
            "Roundness",
            "The shape's outline: near 0 a rectangle, 1 an ellipse, 2 a diamond, above it a star",
            0.2,
            min=0.01,
            max=20.0,
            soft_max=4.0,
        ),
    }


class RELUME_PG_barn_doors(bpy.types.PropertyGroup):
    """Doors before the light."""

    __annotations__ = {
        "use": _bool("Barn Doors", "Let the light through an opening of this shape alone"),
        **_outline(", at one metre before the light (a sun's: where it shines)", 0.5),
        "shear": _vector(
            "Lean",
            "How far the beam leans to the right and up for each metre, as light that falls "
            "through a window at an angle",
            (0.0, 0.0),
            subtype="XYZ",
        ),
        "rotation": _turn("Rotation", "Turns the opening about the light's axis"),
        "density": _factor("Density", "How much of the light the doors hold back"),
        "invert": _bool("Invert", "Hold the light back inside the opening, and not around it"),
    }


class RELUME_PG_distance(bpy.types.PropertyGroup):
    """Where along the way there is light."""

    __annotations__ = {
        "use_near": _bool("Near", "No light nearer to the lamp than this"),
        "near": _length("Near", "From this distance on there is all of the light", 1.0),
        "near_edge": _length("Near Edge", "How far before that the light begins to fade in"),
        "use_far": _bool("Far", "No light farther from the lamp than this"),
        "far": _length("Far", "Up to this distance there is all of the light", 10.0),
        "far_edge": _length("Far Edge", "How far beyond that the light has faded out"),
        "along_axis": _bool(
            "Along Axis",
            "Measure straight ahead of the light, so that it begins and ends at walls across its "
            "axis, and not at spheres around it",
        ),
    }


class RELUME_PG_falloff(bpy.types.PropertyGroup):
    """How fast light fades with the distance."""

    __annotations__ = {
        "use": _bool("Falloff", "Let the light fade with distance as you like"),
        "exponent": _float(
            "Exponent",
            "2 is how real light fades, 1 is slower, 0 does not fade at all, more is faster",
            2.0,
            max=10.0,
            soft_max=4.0,
        ),
        "distance": _length(
            "Reference", "At this distance the light is as bright as a real one", 1.0, min=1e-6
        ),
    }


class RELUME_PG_slide(bpy.types.PropertyGroup):
    """An image in the beam."""

    __annotations__ = {
        "use": _bool("Slide", "Put an image into the beam"),
        "image": bpy.props.PointerProperty(
            name="Image",
            description="What is put into the beam. Where it is transparent the light passes",
            type=bpy.types.Image,
            update=_changed,
        ),
        "kind": bpy.props.EnumProperty(
            name="Use",
            description="What the image does to the light",
            items=_SLIDE_KINDS,
            update=_changed,
        ),
        "density": _factor("Density", "How strongly it shows; 0 is as if it were not there"),
        "scale": _vector(
            "Size",
            "How wide and high the image is at one metre before the light (a sun's: where it "
            "shines)",
            (1.0, 1.0),
            min=1e-6,
            subtype="XYZ_LENGTH",
        ),
        "offset": _vector(
            "Offset",
            "How far its middle is moved to the right and up, there",
            (0.0, 0.0),
            subtype="XYZ_LENGTH",
        ),
        "rotation": _turn("Rotation", "Turns the image about the light's axis"),
        "blur": _float(
            "Blur",
            "How far out of focus it is, as a share of the image's shorter side",
            max=1.0,
            soft_max=0.2,
            precision=3,
        ),
        "invert": _bool("Invert", "Use the image's negative"),
        "repeat": _bool("Repeat", "Tile the image over the whole beam"),
        "frame": _bool("Frame", "No light beside the image, as a slide has a frame", default=True),
    }


class RELUME_PG_noise(bpy.types.PropertyGroup):
    """Uneven light."""

    __annotations__ = {
        "use": _bool("Noise", "Make the light uneven, as foliage, water or a dirty lens does"),
        "amount": _float(
            "Amount",
            "How uneven the light is. 1 doubles it at most, and takes it away at most",
            1.0,
            max=100.0,
            soft_max=5.0,
        ),
        "scale": _float("Scale", "How many patches there are in a metre", 2.0, soft_max=50.0),
        "detail": _float("Detail", "How much finer structure the patches have", 2.0, max=15.0),
        "roughness": _factor("Roughness", "How strong the finer structure is", 0.5),
        "offset": _vector(
            "Offset",
            "Moves the pattern, in patches. Animate it for light through moving leaves or water",
            (0.0, 0.0, 0.0),
            subtype="XYZ",
        ),
        "projected": _bool(
            "Projected",
            "The pattern is on the lens and runs out with the light. Off: it stands in space "
            "before the light, as haze",
            default=True,
        ),
    }


class RELUME_PG_blocker(bpy.types.PropertyGroup):
    """A card in the beam."""

    __annotations__ = {
        "use": _bool("Use", "Hold light back with this card", default=True),
        "object": bpy.props.PointerProperty(
            name="Object",
            description="Where the card is: it lies flat across this object's Z axis, and moves, "
            "turns and grows with it. An empty will do",
            type=bpy.types.Object,
            update=_changed,
        ),
        **_outline(", in the object's own units", 1.0),
        "density": _factor("Density", "How much of the light the card holds back"),
        "color": _vector(
            "Color",
            "The light that still comes through: black is a flag, a colour is a gel",
            (0.0, 0.0, 0.0),
            min=0.0,
            soft_max=1.0,
            subtype="COLOR",
        ),
        "invert": _bool("Window", "An endless card with a hole of this shape"),
    }


class RELUME_PG_light_shadow(bpy.types.PropertyGroup):
    """How the light's shadows are cheated."""

    __annotations__ = {
        "color": _vector(
            "Color",
            "What shadows are filled with, against the light's brightness: black is a real shadow",
            (0.0, 0.0, 0.0),
            min=0.0,
            soft_max=1.0,
            subtype="COLOR",
        ),
        "density": _factor("Density", "1 is as dark as it gets, 0 is no shadow"),
        "softness": _float(
            "Softness",
            "How large the light is for its shadows alone: 0 is a hard shadow, 2 is twice as soft "
            "as the light itself gives",
            1.0,
            max=1000.0,
            soft_max=5.0,
        ),
        "offset": _vector(
            "Offset",
            "Moves where the shadows come from, and not the light: out of a face, say, while its "
            "highlights stay (of a sun: against one metre of its way)",
            (0.0, 0.0, 0.0),
            subtype="TRANSLATION",
        ),
        "hide_highlights": _bool(
            "No Highlights",
            "No highlights of this light in its shadows, however they are filled",
            default=True,
        ),
    }


class RELUME_PG_light(bpy.types.PropertyGroup):
    """What shapes a light beyond Blender's own settings."""

    __annotations__ = {
        "barn_doors": bpy.props.PointerProperty(type=RELUME_PG_barn_doors),
        "distance": bpy.props.PointerProperty(type=RELUME_PG_distance),
        "falloff": bpy.props.PointerProperty(type=RELUME_PG_falloff),
        "slide": bpy.props.PointerProperty(type=RELUME_PG_slide),
        "noise": bpy.props.PointerProperty(type=RELUME_PG_noise),
        "blockers": bpy.props.CollectionProperty(type=RELUME_PG_blocker),
        "active_blocker": bpy.props.IntProperty(name="Active Blocker", min=0),
        "shadow": bpy.props.PointerProperty(type=RELUME_PG_light_shadow),
        "diffuse": _float(
            "Diffuse", "How much of the light matte surfaces send on", 1.0, soft_max=2.0
        ),
        "specular": _float("Specular", "How strong the light's highlights are", 1.0, soft_max=2.0),
        "ambient": _float(
            "Ambient",
            "How much of the light reaches all that it is aimed at, whichever way it faces and "
            "whether it is in shadow or not",
            soft_max=1.0,
        ),
    }


CLASSES = (
    RELUME_PG_barn_doors,
    RELUME_PG_distance,
    RELUME_PG_falloff,
    RELUME_PG_slide,
    RELUME_PG_noise,
    RELUME_PG_blocker,
    RELUME_PG_light_shadow,
    RELUME_PG_light,
)

_register_classes, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Give every light its controls; nothing to do where the command line did."""
    if hasattr(bpy.types.Light, "relume"):
        return
    _register_classes()
    bpy.types.Light.relume = bpy.props.PointerProperty(type=RELUME_PG_light)


def unregister() -> None:
    """Take them away again; what a .blend saved of them stays in it."""
    if not hasattr(bpy.types.Light, "relume"):
        return
    del bpy.types.Light.relume
    _unregister_classes()
