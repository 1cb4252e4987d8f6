# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes one caching camera: Cycles' AOVs made into a deep framebuffer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..scene.geometry_reader import NO_MATERIAL
from .aov_render import PASS_NORMAL, Region, Stage, far_is_nothing
from .channels import CHANNEL_BY_NAME
from .framebuffer import DeepFramebuffer
from .occlusion_filter import REACH, smooth_occlusion, without_edge_hits
from .plan import ChannelPlan
from .ray_occlusion import OcclusionCaster
from .specialize import SpecializedMaterial, channel_expression
from .specialize_closures import DEFAULT_SURFACE
from .specialize_expression import Constant
from .texel_means import take_means

# Pictures of what lies behind sheer surfaces that a camera has at most; the last one shows what
# lies behind all of them.
MOST_BEHIND = 8
_ALL_LAYERS = 1 << 20

# Texels about what a picture shows behind the one before: those of a bilinear footprint, and one
# more.
_MARGIN = 2

# Texels beside these that have a say in them: by the filter of ambient occlusion, and by what mends
# each of its texels. That of the means reaches less far.
_BESIDE = REACH + 1


def bake_camera(
    stage: Stage,
    camera: CachingCamera,
    plan: ChannelPlan,
    materials: Sequence[SpecializedMaterial],
    occlusion: OcclusionCaster,
) -> DeepFramebuffer:
    """The deep framebuffer of one camera, and what lies behind the sheer surfaces that it shows.

    Those are left out of a further picture one layer at a time, until none is seen: the first one
    along each texel's ray, then the first two, and so on. A cut-out before them counts as one.

    Args:
        stage: renders the AOVs of the plan's stored channels.
        camera: at the resolution that is baked.
        plan: of the scene's materials.
        materials: what `plan` numbers.
        occlusion: casts the rays of surfaces that have no material.

    Raises:
        InputError: Cycles wrote no picture, or a material gives values that are not finite.
    """
    first = _picture(stage, camera, plan, materials, occlusion)
    sheer = [number for number, m in enumerate(materials, start=1) if m.is_sheer]
    if not sheer:
        return first
    behind: list[DeepFramebuffer] = []
    through = _shows(first, sheer, plan)
    try:
        while through.any() and len(behind) < MOST_BEHIND:
            left_out = len(behind) + 1 if len(behind) + 1 < MOST_BEHIND else _ALL_LAYERS
            for material in materials:
                material.leave_out(left_out)
            region = Region.around(through, _MARGIN + _BESIDE)
            picture = _picture(stage, camera, plan, materials, occlusion, region=region)
            seen = _shows(picture, sheer, plan)
            kept = maximum_filter(through, 2 * _MARGIN + 1, mode="constant")
            for values in picture.channels.values():
                values[~kept] = 0.0
            behind.append(DeepFramebuffer(camera, picture.channels))
            through &= seen
    finally:
        for material in materials:
            material.leave_out(0)
    return DeepFramebuffer(camera, first.channels, first.wide, tuple(behind))


def _shows(
    picture: DeepFramebuffer, materials: Sequence[int], plan: ChannelPlan
) -> NDArray[np.bool_]:
    """(R, R) where a picture shows materials of these numbers."""
    ids = picture.channels.get("material_id")
    hit = picture.channels["depth"][..., 0] > 0.0
    if ids is None:
        # All that is shown is of one material.
        return hit & (len(materials) == len(plan.material_names))
    return hit & np.isin(np.rint(ids[..., 0]), materials)


def _picture(
    stage: Stage,
    camera: CachingCamera,
    plan: ChannelPlan,
    materials: Sequence[SpecializedMaterial],
    occlusion: OcclusionCaster,
    *,
    region: Region | None = None,
) -> DeepFramebuffer:
    """One picture, of what is shown now. Arguments and errors as of `bake_camera`; `region` as of
    `Stage.render`."""
    rendered = stage.render(camera, region)
    rendered["depth"] = far_is_nothing(rendered["depth"], camera.far)
    channels = {name: rendered[name] for name in plan.stored}
    if means := stage.render_means(camera):
        take_means(channels, means, camera, plan)
    if NO_MATERIAL in plan.material_names:
        _show_default(camera, channels, rendered[PASS_NORMAL], plan, occlusion)
    elif "material_id" in channels:
        # What is none of the scene's materials is none of its triangles either.
        channels["depth"][channels["material_id"] == 0.0] = 0.0
    nothing = channels["depth"] == 0.0
    for values in channels.values():
        np.copyto(values, np.float32(0.0), where=nothing)
    _check_finite(channels, materials, camera)
    if "ambient_occlusion" in channels:
        share, surface = channels["ambient_occlusion"], (channels["depth"], channels["normal"])
        if not stage.measures_sky:
            share = without_edge_hits(camera, share, *surface, occlusion.rays)
        channels["ambient_occlusion"] = smooth_occlusion(camera, share, *surface, occlusion.rays)
    return DeepFramebuffer(camera, channels)


def _show_default(
    camera: CachingCamera,
    channels: dict[str, NDArray[np.float32]],
    normal: NDArray[np.float32],
    plan: ChannelPlan,
    occlusion: OcclusionCaster,
) -> None:
    """Surfaces without a material write no AOVs: give them Cycles' default surface."""
    if "material_id" not in channels:
        missing = channels["depth"][..., 0] > 0.0
    else:
        missing = (channels["depth"][..., 0] > 0.0) & (channels["material_id"][..., 0] == 0.0)
    if not missing.any():
        return
    values: dict[str, Any] = {
        "material_id": 1.0 + plan.material_names.index(NO_MATERIAL),
    }
    if "ambient_occlusion" in channels:
        depth = channels["depth"][..., 0]
        share = occlusion.open_share(camera, missing, depth, normal[missing])
        values["ambient_occlusion"] = share[:, None]
    for name, pixels in channels.items():
        channel = CHANNEL_BY_NAME[name]
        if name in values:
            pixels[missing] = values[name]
        elif channel.field == "normal":
            pixels[missing] = normal[missing]
        elif name != "depth":
            default = channel_expression(DEFAULT_SURFACE, channel)
            assert isinstance(default, Constant)
            pixels[missing] = default.values[: pixels.shape[-1]]


def _check_finite(
    channels: Mapping[str, NDArray[np.float32]],
    materials: Sequence[SpecializedMaterial],
    camera: CachingCamera,
) -> None:
    for name, pixels in channels.items():
        finite = np.isfinite(pixels)
        if finite.all():
            continue
        broken = ~finite.all(axis=-1)
        number = 1
        if "material_id" in channels:
            number = int(np.nan_to_num(channels["material_id"][broken][0, 0]))
        material = materials[number - 1].name if 0 < number <= len(materials) else "(none)"
        raise InputError(
            f"material '{material}' gives '{name}' that is not finite (caching camera "
            f"{camera.id}); mend its nodes"
        )
