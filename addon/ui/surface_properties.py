# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface edits that a .blend keeps, as material.relume_edit and object.relume_edit."""

from __future__ import annotations

from typing import Any

import bpy

from ..scene.surface_edit import LARGEST_FACTOR, WHITE, SurfaceEdit
from ..scene.surface_edit_reader import EDIT_NAME
from .surface_edit_watch import OWNERS, note_edit

_NEUTRAL = SurfaceEdit()


def _factor(name: str, description: str) -> Any:
    return bpy.props.FloatProperty(
        name=name,
        description=description,
        default=1.0,
        min=0.0,
        soft_max=2.0,
        max=LARGEST_FACTOR,
        step=5,
        precision=3,
        update=note_edit,
    )


def _tint(name: str, description: str) -> Any:
    return bpy.props.FloatVectorProperty(
        name=name,
        description=description,
        subtype="COLOR",
        size=3,
        default=WHITE,
        min=0.0,
        soft_max=1.0,
        max=LARGEST_FACTOR,
        update=note_edit,
    )


class RELUME_PG_surface_edit(bpy.types.PropertyGroup):
    """What is changed about a material or an object while it is relit. The names are those of
    `SurfaceEdit`."""

    __annotations__ = {
        "gain": _factor(
            "Gain",
            "Multiplies the colours: diffuse, translucent, sheen, metal and glossy. Not the gloss "
            "of plastics and coats",
        ),
        "tint": _tint("Tint", "The same for each of red, green and blue"),
        "roughness": _factor(
            "Roughness", "Multiplies the roughness of all gloss, coats too, up to a roughness of 1"
        ),
        "roughness_offset": bpy.props.FloatProperty(
            name="Offset",
            description="Is added to the roughness, after it was multiplied",
            default=_NEUTRAL.roughness_offset,
            min=-1.0,
            max=1.0,
            step=1,
            precision=3,
            update=note_edit,
        ),
        "specular": _factor(
            "Specular",
            "Multiplies the gloss: of plastics and coats their reflectance at the front, as "
            "Specular IOR Level has it; of metals and glossy shaders their weight",
        ),
        "specular_tint": _tint(
            "Specular Tint", "The same for each of red, green and blue. It does not tint colours"
        ),
        "emission": _factor(
            "Emission", "Multiplies what the surface glows, as it is seen and as it lights others"
        ),
    }


def register() -> None:
    """Give every material and object its edit."""
    bpy.utils.register_class(RELUME_PG_surface_edit)
    for owner in OWNERS:
        setattr(owner, EDIT_NAME, bpy.props.PointerProperty(type=RELUME_PG_surface_edit))


def unregister() -> None:
    """Take them away again; what a .blend saved of them stays in it."""
    for owner in OWNERS:
        delattr(owner, EDIT_NAME)
    bpy.utils.unregister_class(RELUME_PG_surface_edit)
