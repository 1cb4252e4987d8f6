# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin of addon/glsl/passes/light.glsl, from Blender's light attributes themselves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.relight.light_points.light_sample import LightSample
from addon.relight.lights.light_objects import ObjectShares
from addon.scene.frame_across import frame_across
from addon.scene.light import Light
from addon.scene.light_controls import NEUTRAL

from .bsdf import Lobe, dot
from .highlight import SMALL_CELL_SQ, Cells, half_alphas, half_slopes, half_vector, is_point
from .light_filters import light_filters
from .surfaces import Surfaces

Array = NDArray[np.float64]


def light_layer(
    surface: Surfaces,
    light: Light,
    sample: LightSample,
    visibility: Array | None = None,
    shares: ObjectShares | None = None,
    *,
    spots: NDArray[np.bool_] | None = None,
) -> Array:
    """(H, W, 3) radiance that one point of a light causes; `visibility` (H, W) is of its shadow,
    `shares` of the objects that `surface` tells, `spots` (H, W, S) are those of its cell that are
    open."""
    to_diffuse, to_specular, blocks = _shares(surface, shares)
    L, strength, cell_sq = incidence(surface, light, sample)
    shape, controls = (*L.shape[:2], 3), light.controls
    front, back, shine, hidden, albedo = (np.zeros(shape) for _ in range(5))
    for number in range(1, surface.lobes + 1):
        lobe = Lobe(surface, number)
        weight = to_diffuse * light.diffuse_factor * controls.diffuse * lobe.view_weight
        weight = weight * strength[..., None]
        front = front + weight * (lobe.diffuse(L) * lobe.transmission + lobe.sheen(L))
        through = np.maximum(-dot(lobe.N, L), 0.0)[..., None] / np.pi * lobe.translucent_color
        back = back + weight * through
        weight = to_specular * light.specular_factor * controls.specular * lobe.view_weight
        gloss = specular(lobe, surface, light, sample, (L, strength, cell_sq))
        if visibility is not None:
            gloss = gloss / np.maximum(share_above(surface, light, sample), 0.02)[..., None]
        shine = shine + weight * gloss
        if visibility is not None:
            part = visibility
            if spots is not None:
                part = highlight_open(lobe, surface, light, sample, spots)
            hidden = hidden + weight * gloss * (1.0 - part)[..., None]
        albedo = albedo + lobe.view_weight * (lobe.diffuse_color + lobe.translucent_color)
    base, color = front + back, light.intensity * _tint(sample)
    arriving, highlight = np.broadcast_to(color, shape), shine * color
    if visibility is not None:
        NgoL = dot(surface.geometric_normal[..., :3], L)[..., None]
        own = np.where(NgoL > 0.0, front, np.where(NgoL < 0.0, back, 0.0))
        base = np.where(blocks, own, base)
        shine, hidden = (np.where(blocks & (NgoL <= 0.0), 0.0, x) for x in (shine, hidden))
        seen, shadow = visibility[..., None], controls.shadow
        fill = (color @ [0.2126, 0.7152, 0.0722]) * np.array(shadow.color)
        arriving = color + shadow.density * (1.0 - seen) * (fill - color)
        behind = 0.0 if shadow.hide_highlights else color + shadow.density * (fill - color)
        highlight = (shine - hidden) * color + hidden * behind
    ambient = controls.ambient / np.pi * to_diffuse * albedo * color * strength[..., None]
    total = base * arriving + highlight + ambient
    if controls != NEUTRAL:
        total = total * light_filters(light, surface.position[..., :3] + surface.origin)
    return np.where(surface.hit[..., None], total, 0.0)


def _shares(surface: Surfaces, shares: ObjectShares | None) -> tuple[Array, Array, Any]:
    """(H, W, 1) each: what reaches diffuse and specular lobes, and whether it blocks itself."""
    if shares is None or surface.objects is None:
        one = np.ones((*surface.hit.shape, 1))
        return one, one, one > 0.0
    weights = shares.weights[surface.objects]
    return weights[..., :1], weights[..., 1:], shares.blocks[surface.objects][..., None]


def _tint(sample: LightSample) -> Array:
    return np.ones(3) if sample.emitter is None else sample.emitter.tint


def specular(
    lobe: Lobe,
    surface: Surfaces,
    light: Light,
    sample: LightSample,
    lit: tuple[Array, Array, Array],
) -> Array:
    """(H, W, 3) a lobe's radiance for an intensity of 1."""
    L, strength, cell_sq = lit
    if light.type == "MESH":
        return strength[..., None] * lobe.specular(L, cell_sq)
    cells = light_cells(surface, light, sample, lobe.N_specular)
    # Phong's disks overlap, of lights that are parted into cells.
    parted = _parts(light, sample) > 1
    wide = np.where(lobe.distribution == 4.0, 1.5 if parted else 1.0, 1.0)
    point = strength[..., None] * lobe.specular(L, cell_sq * wide)
    if not cells.radiance.any():
        return point
    half = half_vector(lobe, cells)
    seen = (half.LoH > 0.0) & (half.NoL > 0.0) & (lobe.NoV > 0.0) & (half.mass > 0.0)
    seen &= dot(half.N, lobe.V) > 0.0
    LoH, NoL = np.where(seen, half.LoH, 1.0), np.where(seen, half.NoL, 1.0)
    mass = np.where(seen, half.mass, 0.0)
    NoH = np.where(seen, half.NoH, 1.0)
    terms = lobe.smooth_terms(half.N, half.L, LoH=LoH, NoH=NoH, NoL=NoL, mass=mass)
    if light.type == "SPOT" and sample.per_receiver:
        place = surface.position[..., :3] + surface.origin
        cones = np.stack([_cone(light, -w) for w in _ways_to_spots(light, sample, place)], axis=2)
        whole = _highlight_mean(lobe, surface, light, sample, cones)
        shaped = np.where(half.mass > 1e-3, whole, _cone(light, -half.L))
    elif light.type == "SPOT":
        part = np.minimum(half.mass, 1.0)
        shaped = (1.0 - part) * _cone(light, -L) + part * _cone(light, -half.L)
    elif light.type == "AREA":
        shaped = _spread(light, np.maximum(-dot(half.L, light.direction), 1e-6))
    else:
        shaped = np.ones(L.shape[:2])
    with np.errstate(invalid="ignore"):
        value = terms * (cells.radiance * shaped)[..., None]
    value = np.where(seen[..., None], value, 0.0)
    return np.where(is_point(lobe, cells)[..., None], point, value)


def highlight_open(
    lobe: Lobe, surface: Surfaces, light: Light, sample: LightSample, spots: NDArray[np.bool_]
) -> Array:
    """(H, W) the share of a lobe's highlight that comes from open spots, each as the lobe, widened
    to the spot's part of the cell, sees it."""
    cells = light_cells(surface, light, sample, lobe.N_specular)
    small = cells.angular_sq < SMALL_CELL_SQ * np.prod(half_alphas(lobe, cells), axis=-1)
    share = _highlight_mean(lobe, surface, light, sample, spots.astype(np.float64))
    return np.where(small, spots.mean(axis=-1), share)


def _highlight_mean(
    lobe: Lobe, surface: Surfaces, light: Light, sample: LightSample, values: Array
) -> Array:
    """(H, W) the mean of values (H, W, S) at a cell's spots, as a lobe sees these."""
    place = surface.position[..., :3] + surface.origin
    ways = np.stack(_ways_to_spots(light, sample, place), axis=2)
    cells = light_cells(surface, light, sample, lobe.N_specular)
    s, NoL = half_slopes(lobe, cells, ways)
    L = incidence(surface, light, sample)[0]
    LoH = np.maximum(np.sqrt(np.maximum(0.5 * (1.0 + dot(L, lobe.V)), 0.0)), 0.05)
    spread = (0.125 * cells.angular_sq / values.shape[-1] / LoH)[..., None]
    axes = half_alphas(lobe, cells)
    s_sq = np.sum((s * (axes / np.sqrt(axes**2 + spread))[..., None, :]) ** 2, axis=-1)
    gaussian = (lobe.distribution > 1.5)[..., None]
    weight = np.where(gaussian, np.exp(-s_sq), (1.0 + s_sq) ** -2.0) * (NoL > 0.0)
    total = weight.sum(axis=-1)
    share = (weight * values).sum(axis=-1) / np.where(total > 0.0, total, 1.0)
    plain = _cone(light, -L) if light.type == "SPOT" else values.mean(axis=-1)
    return np.where(total <= 1e-30, plain, share)


def _ways_to_spots(light: Light, sample: LightSample, place: Array) -> list[Array]:
    """(H, W, 3) each."""
    if light.type == "SUN":
        return [np.broadcast_to(spot, place.shape) for spot in sample.spots]
    if sample.per_receiver:
        return [turned_way(light, place, spot[:2])[0] for spot in sample.spots]
    return [spot - place for spot in sample.spots]


def light_cells(surface: Surfaces, light: Light, sample: LightSample, N: Array) -> Cells:
    """What the sample's part of the light is to each pixel."""
    place = surface.position[..., :3] + surface.origin
    share = 1.0 / _parts(light, sample)
    if light.type == "SUN":
        corners = np.broadcast_to(sample.corners, (*place.shape[:2], *sample.corners.shape))
        extent = 2.0 * np.pi * (1.0 - np.cos(0.5 * light.angle))
    elif light.type == "AREA":
        corners = sample.corners - place[:, :, None]
        extent = light.area
    else:
        corners = _lamp_corners(light, sample, place, N)
        extent = np.pi * light.shadow_soft_size**2
    L, _, cell_sq = incidence(surface, light, sample)
    radiance = np.full(place.shape[:2], 1.0 / (extent * share) if extent > 0.0 else 0.0)
    if light.type == "AREA":
        radiance = np.where(dot(L, light.direction) < 0.0, radiance, 0.0)
    if sample.per_receiver:
        # Who is inside a ball sees all of it each time.
        radiance = np.where(_is_inside(light, place), radiance * share, radiance)
    return Cells(corners, cell_sq, radiance)


def _parts(light: Light, sample: LightSample) -> int:
    """Of how many cells a lobe sees one in the sample."""
    return sample.count if light.type in ("SUN", "AREA") or sample.per_receiver else 1


def _is_inside(light: Light, place: Array) -> NDArray[np.bool_]:
    distance = np.linalg.norm(place - light.position, axis=-1)
    return np.asarray((distance <= light.shadow_soft_size) & (not light.use_soft_falloff))


def _lamp_corners(light: Light, sample: LightSample, place: Array, N: Array) -> Array:
    if sample.per_receiver:
        ways = [turned_way(light, place, corner[:2])[0] for corner in sample.corners]
        angle = 2.0 * np.pi * np.arange(len(ways)) / len(ways)
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        about_N = N[:, :, None] + 1e4 * np.einsum("cj,hwjk->hwck", ring, _duff_frames(N))
        inside = _is_inside(light, place)[..., None, None]
        return np.where(inside, about_N, np.stack(ways, axis=2))
    axis = light.position - place
    d_sq = dot(axis, axis)
    radius = np.full(d_sq.shape, light.shadow_soft_size)
    if not light.use_soft_falloff:
        inside = d_sq <= radius**2
        with np.errstate(divide="ignore", invalid="ignore"):
            outline = radius / np.sqrt(1.0 - radius**2 / d_sq)
        axis = np.where(inside[..., None], N, axis)
        radius = np.where(inside, 1e4, outline)
    unit = axis / np.linalg.norm(axis, axis=-1, keepdims=True)
    across = np.einsum("cj,hwjk->hwck", sample.corners[:, :2], _duff_frames(unit))
    return np.asarray(axis[:, :, None] + radius[..., None, None] * across)


def _duff_frames(axis: Array) -> Array:
    """(…, 2, 3) Duff et al. 2017."""
    x, y, z = np.moveaxis(axis, -1, 0)
    sign = np.where(z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack([1.0 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    second = np.stack([b, sign + y * y * a, -y], axis=-1)
    return np.stack([first, second], axis=-2)


def share_above(surface: Surfaces, light: Light, sample: LightSample) -> Array:
    """(H, W) the share of a lamp's disk that is above the surface: of a circle, beyond a chord."""
    place = surface.position[..., :3] + surface.origin
    axis = light.position - place
    d_sq = dot(axis, axis)
    radius = light.shadow_soft_size
    if radius <= 0.0 or light.type in ("SUN", "AREA", "MESH") or sample.per_receiver:
        return np.ones_like(d_sq)
    height = dot(axis, surface.geometric_normal[..., :3])
    r_sq = np.full(d_sq.shape, radius**2)
    if not light.use_soft_falloff:
        with np.errstate(divide="ignore", invalid="ignore"):
            r_sq = radius**2 / (1.0 - radius**2 / d_sq)
    rise = np.sqrt(np.maximum(r_sq * (1.0 - height**2 / d_sq), 1e-30))
    x = np.clip(height / rise, -1.0, 1.0)
    share = 0.5 + (np.arcsin(x) + x * np.sqrt(1.0 - x * x)) / np.pi
    if not light.use_soft_falloff:
        share = np.where(d_sq <= radius**2, 1.0, share)
    return share


def incidence(surface: Surfaces, light: Light, sample: LightSample) -> tuple[Array, Array, Array]:
    """L (H, W, 3); strength and squared angular radius of the point's part of the light (H, W)."""
    place = surface.position[..., :3] + surface.origin
    share = 1.0 / _parts(light, sample)
    if light.type == "SUN":
        L = np.broadcast_to(sample.position, place.shape)
        cap = 2.0 * (1.0 - np.cos(0.5 * light.angle))
        return L, np.ones(L.shape[:2]), np.full(L.shape[:2], cap * share)
    if sample.per_receiver:
        return _turned(light, sample, place, share)
    toward = sample.position - place
    t_sq = dot(toward, toward)
    L = toward / np.sqrt(t_sq)[..., None]
    if light.type == "AREA":
        cosine = np.maximum(-dot(L, light.direction), 0.0)
        strength = cosine / t_sq * _spread(light, cosine)
        return L, strength, light.area / np.pi * share * cosine / t_sq
    if light.type == "MESH":
        assert sample.emitter is not None
        cosine = np.abs(dot(L, sample.emitter.normal))
        own = light.area / (np.pi * sample.count)
        strength = cosine / np.maximum(t_sq, own)
        share = 1.0 if sample.count == 1 else 3.0 / sample.count
        return L, strength, light.area / np.pi * share * cosine / t_sq
    r_sq = light.shadow_soft_size**2
    d_sq = np.sum((light.position - place) ** 2, axis=-1)
    disk = float(light.use_soft_falloff)
    outside = d_sq / (t_sq * (d_sq + disk * r_sq))
    with np.errstate(divide="ignore"):
        strength = np.where(d_sq > r_sq, outside, 1.0 / (r_sq + disk * d_sq))
        cell_sq = r_sq * share / np.where(d_sq > r_sq, t_sq, max(r_sq, 1e-300))
    if light.is_flat_spot or sample.on_disk is not None:
        # A disk across the axis: its centre's distance, its points' directions.
        strength, cell_sq = 1.0 / (d_sq + disk * r_sq), r_sq * share / t_sq
    if light.type == "SPOT":
        strength = strength * _cone(light, -L)
    return L, strength, cell_sq


def _turned(
    light: Light, sample: LightSample, place: Array, share: float
) -> tuple[Array, Array, Array]:
    """`incidence` where each receiver has its own point of the lamp."""
    assert sample.on_disk is not None
    toward, strength = turned_way(light, place, sample.on_disk)
    t = np.linalg.norm(toward, axis=-1)
    L = toward / t[..., None]
    if light.type == "SPOT":
        ways = _ways_to_spots(light, sample, place)[:4]
        strength = strength * np.mean([_cone(light, -way) for way in ways], axis=0)
    return L, strength, light.shadow_soft_size**2 * share / t**2


def turned_way(light: Light, place: Array, on_disk: Array) -> tuple[Array, Array]:
    """The way (H, W, 3) from each place to its own point of a lamp, and the strength (H, W): on the
    disk across the way to it, or in the cone of the lamp's ball. A rotation takes the light's axis
    to that way."""
    radius = light.shadow_soft_size
    away = place - light.position
    d = np.linalg.norm(away, axis=-1)
    axis = away / d[..., None]
    flat = on_disk @ frame_across(light.direction)
    half = axis + light.direction
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    offset = flat - 2.0 * dot(half, flat)[..., None] * half
    if light.use_soft_falloff:
        toward = offset - away
        return toward, d / np.linalg.norm(toward, axis=-1) ** 3
    outside = d > radius
    inside_cone = np.sqrt(1.0 - np.minimum(radius / d, 1.0) ** 2)
    one_minus = np.minimum(radius / d, 1.0) ** 2 / (1.0 + inside_cone)
    widest = np.where(outside, one_minus, 2.0)
    # Corners of cells lie a little outside of the disk.
    drop = np.minimum(widest * np.sum(on_disk**2) / radius**2, 2.0)
    cosine, sine = 1.0 - drop, np.sqrt(drop * (2.0 - drop))
    across = offset / np.linalg.norm(flat) if flat.any() else offset
    direction = sine[..., None] * across - cosine[..., None] * axis
    chord = np.sqrt(np.maximum(radius**2 - (d * sine) ** 2, 0.0))
    t = np.maximum(d * cosine + np.where(outside, -chord, chord), 1e-7 * radius)
    return t[..., None] * direction, 2.0 * widest / radius**2


def _cone(light: Light, direction: Array) -> Array:
    in_light = direction @ np.linalg.inv(light.world_from_light[:3, :3]).T
    cosine = -in_light[..., 2] / np.linalg.norm(in_light, axis=-1)
    edge = np.cos(0.5 * light.spot_size)
    if light.spot_blend == 0.0:
        return (cosine > edge).astype(np.float64)
    x = np.clip((cosine - edge) / ((1.0 - edge) * light.spot_blend), 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))


def _spread(light: Light, cosine: Array) -> Array:
    if light.spread >= np.pi:
        return np.ones_like(cosine)
    half = 0.5 * light.spread
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    return np.maximum((np.tan(half) - np.tan(angle)) / (np.tan(half) - half), 0.0)
