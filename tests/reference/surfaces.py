# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces as float64 arrays, and the same as the textures that the passes read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from addon.corrmap.surface_buffer import SurfaceBuffer
from addon.glsl.shader import texture_from_array

FIELDS = (
    "position",
    "geometric_normal",
    "shading",
    "diffuse",
    "specular_f0",
    "specular_f90",
    "emission",
)


@dataclass(frozen=True)
class Surfaces:
    """`SurfaceBuffer`'s textures as (H, W, 4) float64, exactly representable in float32."""

    origin: NDArray[np.float64]
    eye: NDArray[np.float64]
    perspective: bool
    position: NDArray[np.float64]
    geometric_normal: NDArray[np.float64]
    shading: NDArray[np.float64]
    diffuse: NDArray[np.float64]
    specular_f0: NDArray[np.float64]
    specular_f90: NDArray[np.float64]
    emission: NDArray[np.float64]

    @property
    def toward_viewer(self) -> NDArray[np.float64]:
        """(H, W, 3) unit vectors towards the viewer."""
        toward = self.eye - self.position[..., :3] * float(self.perspective)
        return toward / np.linalg.norm(toward, axis=-1, keepdims=True)

    @property
    def hit(self) -> NDArray[np.bool_]:
        """(H, W) where a surface is seen."""
        return self.position[..., 3] > 0.0

    def upload(self) -> SurfaceBuffer:
        """The same on the GPU."""
        height, width, _ = self.position.shape
        textures = {
            name: texture_from_array(getattr(self, name).astype(np.float32), "RGBA32F")
            for name in FIELDS
        }
        return SurfaceBuffer(width, height, self.origin, self.eye, self.perspective, **textures)


def surfaces(
    position: NDArray[np.float64],
    normal: NDArray[np.float64],
    *,
    eye: tuple[float, float, float] = (0.0, 0.0, 10.0),
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    albedo: float = 1.0,
) -> Surfaces:
    """Diffuse surfaces at (H, W, 3) local positions; everything else neutral."""
    shape = (*position.shape[:2], 4)

    def packed(rgb: NDArray[np.float64] | float, w: float) -> NDArray[np.float64]:
        values = np.empty(shape, dtype=np.float32)
        values[..., :3], values[..., 3] = rgb, w
        return values.astype(np.float64)

    return Surfaces(
        origin=np.array(origin),
        eye=np.array(eye),
        perspective=True,
        position=packed(position, 1.0),
        geometric_normal=packed(normal, 1.0),
        shading=packed(normal, 1.0),
        diffuse=packed(albedo, 0.0),
        specular_f0=packed(0.0, 0.0),
        specular_f90=packed(0.0, 1.0),
        emission=packed(0.0, 0.0),
    )


def random_surfaces(seed: int, size: int = 96, perspective: bool = True) -> Surfaces:
    """Everything a surface can be, within a few metres of the origin: normals bent from the
    geometric one, some beyond the viewer's horizon; roughness 0 and 1; pixels without surface."""
    rng = np.random.default_rng(seed)
    shape = (size, size)

    def unit(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return values / np.linalg.norm(values, axis=-1, keepdims=True)

    def packed(rgb: NDArray[np.float64], w: NDArray[np.float64]) -> NDArray[np.float64]:
        both = np.concatenate([rgb, w[..., None]], axis=-1)
        return both.astype(np.float32).astype(np.float64)

    position = rng.uniform(-2.0, 2.0, (*shape, 3))
    eye = np.array([0.5, -6.0, 2.0])
    toward = eye - position if perspective else np.broadcast_to(eye, position.shape)
    Ng = unit(rng.normal(size=(*shape, 3)))
    Ng = np.where((Ng * toward).sum(-1, keepdims=True) < 0.0, -Ng, Ng)
    N = unit(Ng + 0.4 * rng.normal(size=(*shape, 3)))
    roughness = rng.random(shape)
    roughness[:4], roughness[4:8], roughness[8:12] = 0.0, 1.0, 0.02
    layer_f0 = 0.2 * rng.random(shape) * (rng.random(shape) < 0.6)
    layer_f90 = np.where(layer_f0 > 0.0, np.maximum(layer_f0, rng.random(shape)), 0.0)
    f0 = rng.random((*shape, 3)) * 0.8
    f90 = f0 + rng.random((*shape, 3)) * (1.0 - f0)
    hit = (rng.random(shape) > 0.05).astype(np.float64)
    return Surfaces(
        origin=np.array([100.0, -50.0, 20.0]),
        eye=eye.astype(np.float32).astype(np.float64),
        perspective=perspective,
        position=packed(position, hit * 3.0),
        geometric_normal=packed(Ng, hit),
        shading=packed(N, roughness),
        diffuse=packed(rng.random((*shape, 3)), layer_f0),
        specular_f0=packed(f0, layer_f90),
        specular_f90=packed(f90, rng.random(shape)),
        emission=packed(rng.random((*shape, 3)) * 10.0, np.zeros(shape)),
    )
