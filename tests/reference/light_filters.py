# SPDX-License-Identifier: GPL-3.0-or-later
"""The twins of addon/glsl/lib/*_filter.glsl, from the formulas in light_controls.py."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from addon.scene.light import Light
from addon.scene.light_controls import (
    BarnDoors,
    Blocker,
    DistanceRange,
    Falloff,
    Noise,
    Slide,
    Superellipse,
)

from .noise_texture import noise_texture

Array = NDArray[np.float64]


def light_filters(light: Light, place: Array) -> Array:
    """(…, 3) what a light's controls let through to (…, 3) world-space places."""
    q = (place - light.position) @ light.axes.T
    controls, is_sun = light.controls, light.type == "SUN"
    through = np.ones(q.shape)
    if controls.distance is not None:
        through = through * distance(controls.distance, q)[..., None]
    if controls.falloff is not None and not is_sun:
        through = through * falloff(controls.falloff, q)[..., None]
    if controls.barn_doors is not None:
        through = through * barn_doors(controls.barn_doors, q, is_sun)[..., None]
    if controls.noise is not None:
        through = through * noise(controls.noise, q, is_sun)[..., None]
    if controls.slide is not None:
        through = through * slide(controls.slide, q, is_sun)
    for card in controls.blockers:
        through = through * blocker(card, light, place)
    return through


def superellipse(outline: Superellipse, p: Array) -> Array:
    """(…) by how much the outline covers (…, 2) points."""
    inner = _reach(p, outline.width, outline.height, outline.roundness)
    outer = _reach(
        p,
        outline.width + outline.width_edge,
        outline.height + outline.height_edge,
        outline.roundness,
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (1.0 - inner) / (outer - inner)
    t = np.where(inner >= 1.0, 0.0, np.where(outer <= 1.0, 1.0, t))
    return np.asarray(1.0 - t * t * (3.0 - 2.0 * t))


def _reach(p: Array, width: float, height: float, roundness: float) -> Array:
    """1 / rho, of the radius rho = (|x/w|^k + |y/h|^k)^(1/k), by logarithms."""
    power = 2.0 / roundness
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.log(np.abs(p[..., 0])) - np.log(width)
        y = np.log(np.abs(p[..., 1])) - np.log(height)
        return np.exp(-np.logaddexp(power * x, power * y) / power)


def across(q: Array, is_sun: bool) -> tuple[Array, NDArray[np.bool_]]:
    """(…, 2) places across the beam, and (…) whether they are before the light."""
    if is_sun:
        return q[..., :2], np.ones(q.shape[:-1], dtype=bool)
    before = q[..., 2] < 0.0
    depth = np.where(before, -q[..., 2], 1.0)
    return q[..., :2] / depth[..., None], before


def _turned_back(p: Array, angle: float) -> Array:
    turn = np.exp(-1j * angle) * (p[..., 0] + 1j * p[..., 1])
    return np.stack([turn.real, turn.imag], axis=-1)


def barn_doors(doors: BarnDoors, q: Array, is_sun: bool) -> Array:
    p, before = across(q, is_sun)
    lean = np.array(doors.shear) * (-q[..., 2:] if is_sun else 1.0)
    covered = before * superellipse(doors.outline, _turned_back(p - lean, doors.rotation))
    kept = 1.0 - covered if doors.invert else covered
    return np.asarray(1.0 - doors.density * (1.0 - kept))


def _step(low: float, high: float, x: Array) -> Array:
    if high <= low:
        return (x > low).astype(np.float64)
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def distance(ends: DistanceRange, q: Array) -> Array:
    r = -q[..., 2] if ends.along_axis else np.linalg.norm(q, axis=-1)
    result = np.ones(r.shape)
    if ends.near > 0.0 or ends.near_edge > 0.0:
        result = 1.0 - _step(-ends.near, -ends.near + ends.near_edge, -r)
    if np.isfinite(ends.far):
        result = result * (1.0 - _step(ends.far, ends.far + ends.far_edge, r))
    return np.asarray(result)


def falloff(own: Falloff, q: Array) -> Array:
    r = np.linalg.norm(q, axis=-1) / own.distance
    with np.errstate(over="ignore", divide="ignore"):
        return np.clip(r ** (2.0 - own.exponent), 2.0**-80, 2.0**80)


def noise(uneven: Noise, q: Array, is_sun: bool) -> Array:
    at = q
    if uneven.projected and is_sun:
        at = q * (1.0, 1.0, 0.0)
    elif uneven.projected:
        at = q / np.linalg.norm(q, axis=-1, keepdims=True)
    factor = noise_texture(uneven.scale * at + uneven.offset, uneven.detail, uneven.roughness)
    return np.maximum(1.0 + uneven.amount * (2.0 * factor - 1.0), 0.0)


def slide(picture: Slide, q: Array, is_sun: bool) -> Array:
    """Of a slide without blur."""
    assert picture.blur == 0.0
    p, before = across(q, is_sun)
    uv = _turned_back(p - picture.offset, picture.rotation) / picture.scale + 0.5
    rgb, alpha = picture.pixels[..., :3].astype(np.float64), picture.pixels[..., 3:]
    if picture.use == "COOKIE":
        rgb = np.broadcast_to((rgb @ [0.2126, 0.7152, 0.0722])[..., None], rgb.shape)
    if picture.invert:
        rgb = np.maximum(1.0 - rgb, 0.0)
    through = _bilinear(alpha * rgb + 1.0 - alpha, uv, picture.repeat)
    beside = 0.0 if picture.repeat or picture.frame else 1.0
    inside = before
    if not picture.repeat:
        inside = before & ((uv >= 0.0) & (uv <= 1.0)).all(axis=-1)
    through = np.where(inside[..., None], through, beside)
    return np.asarray(1.0 - picture.density * (1.0 - through))


def _bilinear(pixels: Array, uv: Array, repeat: bool) -> Array:
    height, width = pixels.shape[:2]
    at = np.clip(uv, -1e9, 1e9) * (width, height) - 0.5
    low = np.floor(at).astype(np.int64)
    t = at - low
    total: Array = np.zeros((*uv.shape[:-1], 3))
    for dx in (0, 1):
        for dy in (0, 1):
            x, y = low[..., 0] + dx, low[..., 1] + dy
            if repeat:
                x, y = x % width, y % height
            texel = pixels[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]
            weight = np.abs(1 - dx - t[..., 0]) * np.abs(1 - dy - t[..., 1])
            total = total + weight[..., None] * texel
    return total


def blocker(card: Blocker, light: Light, place: Array) -> Array:
    """(…, 3) of (…, 3) world-space places."""
    frame, origin = card.world_from_blocker[:3, :3], card.world_from_blocker[:3, 3]
    x, y = frame[:, 0], frame[:, 1]
    normal = np.cross(x, y)
    if not normal.any():
        return np.ones(place.shape)
    start = -light.direction if light.type == "SUN" else light.position - origin
    end = place - origin
    height = end @ normal
    from_height = start @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        if light.type == "SUN":
            hit = end - (height / from_height)[..., None] * start
        else:
            t = from_height / (from_height - height)
            hit = start + t[..., None] * (end - start)
    crosses = np.sign(height) * np.sign(from_height) < 0.0
    hit = np.where(crosses[..., None], hit, 0.0)
    # In the card's own units: the solution of u x + v y = hit.
    uv = np.linalg.lstsq(np.stack([x, y], axis=1), hit.reshape(-1, 3).T)[0].T
    covered = superellipse(card.outline, uv.reshape(*hit.shape[:-1], 2))
    covered = crosses * (1.0 - covered if card.invert else covered)
    return np.asarray(1.0 - card.density * covered[..., None] * (1.0 - np.array(card.color)))
