# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces and bounds of the extremes suite: what float32 can be held to, and by what rule.

A shader is held to *mixed forward-backward stability* (N. J. Higham, Accuracy and Stability of
Numerical Algorithms, 2002, 1.5): what it computes is, up to a few roundings of its own, the exact
result of inputs that are a few roundings off. Roundings are counted, not fitted:

- A direction between two places: a difference and a product for each component (2), the squared
  length (3 products and sums, halved by the root) and its inverse root (2 in the last place): 6.
- A dot product with it: three products and two sums, at most 3 on any path: 8 roundings of half a
  spacing in all are above what a component of any direction, normal or place is off.
- A result: 32 roundings of products and sums behind that.

How much the inputs' roundings move a result is its condition number, and is measured with the
float64 twin: the largest change of a dozen draws of inputs that all are off by the full amount,
with signs drawn. A draw points in no special direction, so twice that is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from addon.caching.channels import CHANNEL_BY_NAME
from addon.glsl.shader import framebuffer, read_texture, texture_2d
from addon.relight.light_points.light_sample import LightSample
from addon.relight.lights.light_pass import LightPass
from addon.scene.light import Light
from tests.reference.surfaces import Surfaces

from .drawing import TABLES

Array = NDArray[np.float64]

SPACING = float(np.finfo(np.float32).eps)
INPUT = 8.0 * 0.5 * SPACING
RESULT = 32.0 * 0.5 * SPACING
# Smaller numbers are flushed to zero on the way: the least product of a result with a factor.
SMALLEST = 1e3 * float(np.finfo(np.float32).tiny)

_DRAWS = 12

SPECULAR = ("specular_f0", "specular_f90", "layer_f0", "layer_f90", "dielectric", "roughness")

GRAZING = np.array([1e-7, 1e-6, 1e-4, 1e-2, 0.1, 0.4, 0.7])
ROUGHNESS = np.array([0.0, 0.004, 0.02, 0.1, 0.3, 0.6, 1.0])
DISTANCES = np.geomspace(1e-6, 1e6, 13)


def exact(values: Array) -> Array:
    """What float32 holds of them."""
    return np.asarray(values.astype(np.float32).astype(np.float64))


def unit(values: Array) -> Array:
    return np.asarray(values / np.linalg.norm(values, axis=-1, keepdims=True))


def between(
    toward_light: Array, toward_viewer: Array, NoL: Array, NoV: Array, sign: Array
) -> Array:
    """(..., 3) unit normals with these cosines; halfway where there is no such normal."""
    c = np.sum(toward_light * toward_viewer, axis=-1)
    rest = np.maximum(1.0 - c * c, 1e-12)
    a, b = (NoL - NoV * c) / rest, (NoV - NoL * c) / rest
    flat = a[..., None] * toward_light + b[..., None] * toward_viewer
    up = unit(np.cross(toward_light, toward_viewer))
    left = 1.0 - np.sum(flat * flat, axis=-1)
    normal = flat + (sign * np.sqrt(np.maximum(left, 0.0)))[..., None] * up
    return np.where((left > 0.0)[..., None], normal, unit(toward_light + toward_viewer))


def around(
    seed: int, size: int = 48, *, distances: Array = DISTANCES, toward: Array | None = None
) -> Surfaces:
    """Surfaces around a light at the local origin, at these distances from it.

    Their normals graze the light, the viewer and both; lobes are from mirrors to chalk.

    Args:
        seed: of the draws.
        size: pixels along the side.
        distances: metres; each is as frequent.
        toward: (size, size, 3) unit directions in which they lie; None for all.
    """
    rng = np.random.default_rng(seed)
    shape = (size, size)
    one = (*shape, 1)
    if toward is None:
        toward = unit(rng.normal(size=(*shape, 3)))
    eye = exact(unit(np.array([0.3, -0.5, 0.8])))
    place = exact(toward * rng.choice(distances, one))
    normal = exact(
        between(
            -toward,
            np.broadcast_to(unit(eye), toward.shape),
            rng.choice(GRAZING, shape),
            rng.choice(GRAZING, shape),
            rng.choice([-1.0, 1.0], shape).astype(np.float64),
        )
    )
    f0 = 0.8 * rng.random((*shape, 3))
    channels = {
        "normal": normal,
        "diffuse_color": rng.random((*shape, 3)),
        "specular_f0": f0,
        "specular_f90": f0 + rng.random((*shape, 3)) * (1.0 - f0),
        "layer_f0": 0.2 * rng.random(one),
        "layer_f90": 0.2 + 0.8 * rng.random(one),
        "dielectric": rng.random(one),
        "roughness": rng.choice(ROUGHNESS, one),
    }
    return Surfaces(
        origin=np.zeros(3),
        eye=eye,
        perspective=False,
        position=np.concatenate([place, np.ones(one)], axis=-1),
        geometric_normal=np.concatenate([normal, np.ones(one)], axis=-1),
        channels={name: exact(values) for name, values in channels.items()},
    )


def perturbed(surface: Surfaces, rng: np.random.Generator, reach: float = 0.0) -> Surfaces:
    """The same with every direction, place and roughness off by INPUT, with signs drawn.

    Places are off by so much of their distance from the local origin; and of `reach`, that of
    the light's own place, which is rounded likewise.
    """

    def off(values: Array, size: Array | float) -> Array:
        return np.asarray(values + INPUT * rng.choice([-1.0, 1.0], values.shape) * size)

    position, normal = surface.position.copy(), surface.geometric_normal.copy()
    length = np.linalg.norm(position[..., :3], axis=-1, keepdims=True) + reach
    position[..., :3] = off(position[..., :3], length)
    normal[..., :3] = off(normal[..., :3], 1.0)
    channels = dict(surface.channels)
    for name, values in channels.items():
        field = CHANNEL_BY_NAME[name].field
        if field in ("normal", "tangent"):
            channels[name] = off(values, 1.0)
        elif field in ("roughness", "diffuse_roughness", "sheen_roughness", "view_roughness"):
            channels[name] = np.clip(off(values, values), 0.0, 1.0)
    eye = off(surface.eye, float(np.linalg.norm(surface.eye)))
    return replace(surface, position=position, geometric_normal=normal, channels=channels, eye=eye)


@dataclass(frozen=True)
class Held:
    """The twin's result and how far float32 may be from it, (H, W, 3) each."""

    want: Array
    bound: Array

    def assert_holds(self, got: Array, *, edges: float = 0.0) -> None:
        """No pixel is odd, negative or out of bounds; a share of `edges` may be out of bounds.

        Args:
            got: (H, W, 3).
            edges: of the pixels, that may lie on a step of no width.
        """
        assert np.isfinite(got).all()
        assert (got >= 0.0).all()
        off = np.abs(got - self.want)
        wrong = (off > self.bound).any(axis=-1)
        worst = np.unravel_index(np.argmax(off / self.bound), off.shape)
        assert wrong.mean() <= edges, (
            f"{wrong.sum()} of {wrong.size} pixels; at {worst}: {got[worst]:g} instead of "
            f"{self.want[worst]:g}, allowed {self.bound[worst]:g}"
        )

    def share_held_to(self, relative: float) -> float:
        """The share of all lit values whose bound is no more than this part of them."""
        lit = self.want > SMALLEST
        return float((self.bound[lit] <= relative * self.want[lit]).mean())


def held(twin: Callable[[Surfaces], Array], surface: Surfaces, reach: float = 0.0) -> Held:
    """What a twin says of surfaces, with the bound of the module's rule.

    Args:
        twin: gives (H, W, 3) for surfaces.
        surface: the surfaces.
        reach: metres from the local origin to the light's own place.
    """
    want = twin(surface)
    rng = np.random.default_rng(99)
    moved = np.max(
        [np.abs(twin(perturbed(surface, rng, reach)) - want) for _ in range(_DRAWS)], axis=0
    )
    return Held(want, 2.0 * moved + RESULT * np.abs(want) + SMALLEST)


class Lamps:
    """Draws lights on one set of surfaces; shaders and textures are kept."""

    def __init__(self, surface: Surfaces) -> None:
        self.surface = surface
        self._buffer = surface.upload()
        self._pass = LightPass(TABLES, surface.layout)
        height, width, _ = surface.position.shape
        self._layer = texture_2d(width, height)
        self._target = framebuffer([self._layer])

    def show(self, surface: Surfaces) -> None:
        """Draw on other surfaces from now on, as many and with the same channels."""
        self.surface = surface
        self._buffer = surface.upload()
        self._pass.set_layout(surface.layout)

    def drawn(self, light: Light, sample: LightSample) -> Array:
        """(H, W, 3) radiance that one point of a light causes, without a shadow."""
        with self._target.bind():
            self._target.clear(color=(0.0, 0.0, 0.0, 0.0))
        self._pass.draw(self._buffer, light, sample, self._target, shadow=None)
        return read_texture(self._layer)[..., :3].astype(np.float64)
