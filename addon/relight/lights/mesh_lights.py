# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects glow, as lights, and which of them matter for a view."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...caching.plan import ChannelPlan
from ...corrmap.surface_layout import SurfaceLayout
from ...scene.geometry import SceneGeometry
from ...scene.light import Light
from ...scene.mesh_light import MeshLight, mesh_light
from ..light_points.light_sample import light_sample

# A glowing object lights the scene if it might give at least this share of the light that arrives
# at the surfaces that the view sees. Less is below a step of an 8-bit display.
LEAST_SHARE = 1e-3

# What gives less than this share outshines nothing: it is not asked where it reaches.
_OUTSHINES = 0.02

# Points of a glowing object that one sample of the view is lit from: its layer has as many times
# more shadow rays.
POINTS = 4

# Points of each by which its share is judged; it only has to be right to a factor of two or so.
_JUDGED_POINTS = 8

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True)
class Glow:
    """What each material sends out by itself.

    Attributes:
        radiance: (M, 3) float64, W/(m2 sr), linear Rec.709: a varying material's mean.
        varies: (M,) bool: whether it is such a mean.
    """

    radiance: NDArray[np.float64]
    varies: NDArray[np.bool_]


def glow(plan: ChannelPlan, layout: SurfaceLayout, table: NDArray[np.float32]) -> Glow:
    """What materials send out, from a plan and the rows of its material table.

    Args:
        plan: of the cache.
        layout: of its surfaces.
        table: (rows, columns, 4), see `MaterialTable.rows`.
    """
    count = len(plan.material_names)
    constant = plan.constant("emission")
    name = plan.same.get("emission", "emission")
    if constant is not None:
        return Glow(np.tile(constant, (count, 1)), np.zeros(count, dtype=np.bool_))
    if name in plan.material_constants:
        radiance = np.array(plan.material_constants[name], dtype=np.float64).reshape(count, 3)
        return Glow(radiance, np.zeros(count, dtype=np.bool_))
    places = [i for i, (channel, _) in enumerate(layout.values) if channel == name]
    rows = table[[i // 4 for i in places], :, [i % 4 for i in places]]
    means = rows[:, 1 : 1 + count].T.astype(np.float64)
    return Glow(np.broadcast_to(means, (count, 3)), means.any(axis=-1))


def mesh_lights(
    geometry: SceneGeometry, of_material: Glow, factors: Mapping[str, float] | None = None
) -> tuple[MeshLight, ...]:
    """A light for each object with glowing triangles, named after it; its instances are one.

    Args:
        geometry: its materials are numbered as `of_material` has them; those beyond don't glow.
        of_material: what they send out.
        factors: by objects' names, what their glow is multiplied with.
    """
    count = len(of_material.radiance)
    radiance = np.concatenate([of_material.radiance, np.zeros((1, 3))])
    varies = np.append(of_material.varies, False)
    material = np.where(geometry.material_id < count, geometry.material_id, count)
    bright = np.flatnonzero((radiance @ _LUMINANCE > 0.0)[material])
    cut_out = {cutout.material_id for cutout in geometry.cutouts}
    names = dict.fromkeys(geometry.object_names)
    place = {name: index for index, name in enumerate(names)}
    named = np.array([place[name] for name in geometry.object_names], dtype=np.int64)
    owner = named[geometry.object_id[bright]]
    lights = []
    for index in np.unique(owner):
        some, name = bright[owner == index], [*names][index]
        problems = []
        if varies[material[some]].any():
            problems.append("its glow varies, and lights the scene with its mean")
        if cut_out.intersection(material[some].tolist()):
            problems.append("it glows with all of its shape, also where that is cut away")
        light = mesh_light(
            name,
            geometry.vertices[geometry.triangles[some]],
            radiance[material[some]] * (factors or {}).get(name, 1.0),
            tuple(f"glowing object '{name}': {problem}" for problem in problems),
        )
        if light.is_lit and light.area > 0.0:
            lights.append(light)
    return tuple(lights)


def shares(
    lights: Sequence[Light],
    others: Sequence[Light],
    receivers: NDArray[np.float64],
    reached: Callable[[Light], NDArray[np.float64]] | None = None,
) -> NDArray[np.float64]:
    """(N,) the share of each of N lights in what arrives at some places: the mean of its shares
    at each, as eyes and displays show what is dark in finer steps.

    A light itself counts as if nothing stood in its way, for it is about what might matter. What
    is beside it counts as far as it reaches a place.

    Args:
        lights: that are judged.
        others: that are beside them.
        receivers: (R, 3) world space: the places; without any, every light is all there is.
        reached: gives for a light (R,) which share of it reaches each place; it is asked only
            while a light is below LEAST_SHARE, and for what outshines it. None for all of it.
    """
    if not lights or not len(receivers):
        return np.ones(len(lights))
    everything = [*lights, *others]
    alone = np.array([_arriving(light, receivers) for light in everything])
    beside, asked = alone.copy(), np.zeros(len(everything), dtype=np.bool_)
    while True:
        rest = np.maximum(beside.sum(axis=0) - beside, 0.0)
        total = alone + rest
        share = np.divide(alone, total, out=np.zeros_like(total), where=total > 0.0).mean(axis=1)
        strong = np.flatnonzero(~asked & (share >= _OUTSHINES)).tolist()
        if reached is None or not strong or share[: len(lights)].min() >= LEAST_SHARE:
            return np.asarray(share[: len(lights)])
        for index in strong:
            beside[index] = alone[index] * reached(everything[index])
            asked[index] = True


def _arriving(light: Light, receivers: NDArray[np.float64]) -> NDArray[np.float64]:
    """(R,) the mean irradiance of surfaces that face a light's points."""
    brightness = float(np.abs(light.intensity) @ _LUMINANCE)
    arriving = np.zeros(len(receivers))
    if light.type == "SUN":
        return arriving + brightness
    for k in range(_JUDGED_POINTS):
        sample = light_sample(light, k, _JUDGED_POINTS)
        way = sample.position - receivers
        distance_sq = np.einsum("rx,rx->r", way, way)
        facing, own = np.ones(len(way)), light.shadow_soft_size**2
        if sample.emitter is not None:
            brightness = float((light.intensity * sample.emitter.tint) @ _LUMINANCE)
            length = np.sqrt(np.maximum(distance_sq, np.finfo(np.float64).tiny))
            facing = np.abs(way @ sample.emitter.normal) / length
            own = light.area / (np.pi * _JUDGED_POINTS)
        near = max(own, float(np.finfo(np.float64).tiny))
        arriving += brightness * facing / np.maximum(distance_sq, near)
    return arriving / _JUDGED_POINTS
