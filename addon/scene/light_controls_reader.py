# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a light's controls: `light.relume` (addon/ui/light_properties.py) into `LightControls`."""

from __future__ import annotations

from typing import Any

from .image_reader import read_image
from .light_controls import (
    MOST_BLOCKERS,
    NEUTRAL,
    BarnDoors,
    Blocker,
    DistanceRange,
    Falloff,
    LightControls,
    Noise,
    ShadowControls,
    Slide,
    Superellipse,
)
from .object_matrix_reader import world_from_object


def read_controls(depsgraph: Any, data: Any, problems: list[str]) -> LightControls:
    """The controls of an evaluated `bpy.types.Light`; neutral where the properties are not
    registered.

    Args:
        depsgraph: what it was evaluated by.
        data: the light.
        problems: takes a phrase for each thing that is not shown.
    """
    group = getattr(data, "relume", None)
    if group is None:
        return NEUTRAL
    return LightControls(
        barn_doors=_barn_doors(group.barn_doors),
        distance=_distance(group.distance),
        falloff=_falloff(data, problems),
        slide=_slide(group.slide, problems),
        noise=_noise(group.noise),
        blockers=_blockers(depsgraph, data, problems),
        shadow=_shadow(group.shadow),
        diffuse=float(group.diffuse),
        specular=float(group.specular),
        ambient=float(group.ambient),
    )


def is_blocker(obj: Any, lights: Any) -> bool:
    """Whether an original object is a blocker of one of some `bpy.types.Light`s."""
    groups = (getattr(data, "relume", None) for data in lights)
    return any(item.object == obj for group in groups if group for item in group.blockers)


def _superellipse(group: Any) -> Superellipse:
    return Superellipse(
        float(group.width),
        float(group.height),
        float(group.width_edge),
        float(group.height_edge),
        float(group.roundness),
    )


def _barn_doors(group: Any) -> BarnDoors | None:
    if not group.use:
        return None
    return BarnDoors(
        _superellipse(group),
        (float(group.shear[0]), float(group.shear[1])),
        float(group.rotation),
        float(group.density),
        bool(group.invert),
    )


def _distance(group: Any) -> DistanceRange | None:
    if not (group.use_near or group.use_far):
        return None
    near = (float(group.near), float(group.near_edge)) if group.use_near else (0.0, 0.0)
    far = (float(group.far), float(group.far_edge)) if group.use_far else (float("inf"), 0.0)
    return DistanceRange(*near, *far, bool(group.along_axis))


def _falloff(data: Any, problems: list[str]) -> Falloff | None:
    group = data.relume.falloff
    if not group.use:
        return None
    if data.type == "SUN":
        problems.append("it is a sun, whose light does not fall off: its falloff is not used")
        return None
    return Falloff(float(group.exponent), float(group.distance))


def _slide(group: Any, problems: list[str]) -> Slide | None:
    if not group.use or group.image is None:
        return None
    pixels = read_image(group.image, problems)
    if pixels is None:
        return None
    return Slide(
        pixels=pixels,
        image=group.image.name,
        use=group.kind,
        density=float(group.density),
        scale=(float(group.scale[0]), float(group.scale[1])),
        offset=(float(group.offset[0]), float(group.offset[1])),
        rotation=float(group.rotation),
        blur=float(group.blur),
        repeat=bool(group.repeat),
        invert=bool(group.invert),
        frame=bool(group.frame),
    )


def _noise(group: Any) -> Noise | None:
    if not group.use:
        return None
    x, y, z = (float(value) for value in group.offset)
    return Noise(
        float(group.amount),
        float(group.scale),
        float(group.detail),
        float(group.roughness),
        (x, y, z),
        bool(group.projected),
    )


def _blockers(depsgraph: Any, data: Any, problems: list[str]) -> tuple[Blocker, ...]:
    used: list[Blocker] = []
    for item in data.relume.blockers:
        if not item.use or item.object is None:
            continue
        if not item.object.original.users_scene:
            # Blender places only what is in a scene.
            problems.append(
                f"its blocker '{item.object.name}' is in no collection of the scene, and takes no "
                "light; link it into one"
            )
            continue
        red, green, blue = (float(value) for value in item.color)
        used.append(
            Blocker(
                name=item.object.original.name,
                world_from_blocker=world_from_object(depsgraph, item.object.original),
                outline=_superellipse(item),
                density=float(item.density),
                color=(red, green, blue),
                invert=bool(item.invert),
            )
        )
    if len(used) > MOST_BLOCKERS:
        problems.append(f"only the first {MOST_BLOCKERS} of its {len(used)} blockers take light")
    return tuple(used[:MOST_BLOCKERS])


def _shadow(group: Any) -> ShadowControls:
    red, green, blue = (float(value) for value in group.color)
    x, y, z = (float(value) for value in group.offset)
    return ShadowControls(
        color=(red, green, blue),
        density=float(group.density),
        softness=float(group.softness),
        offset=(x, y, z),
        hide_highlights=bool(group.hide_highlights),
    )
