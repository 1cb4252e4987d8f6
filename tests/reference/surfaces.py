# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces as float64 arrays, and the same as the textures that the passes read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from addon.caching.channels import CHANNEL_BY_NAME, channels_of, lobe_channel
from addon.caching.plan import ChannelPlan
from addon.corrmap.normal_bend import NormalBend
from addon.corrmap.surface_buffer import SurfaceBuffer
from addon.corrmap.surface_layout import SurfaceLayout
from addon.glsl.shader import Texture, texture_from_array

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Surfaces:
    """`SurfaceBuffer`'s contents as (H, W, …) float64, exactly representable in float32.

    `channels` are (H, W, components) by the channel table's names; one that is missing is neutral.
    """

    origin: Array
    eye: Array
    perspective: bool
    position: Array
    geometric_normal: Array
    channels: Mapping[str, Array]
    lobes: int = 1
    # (H, W) index of the object that is seen, -1 for none; None where nobody asks.
    objects: NDArray[np.int64] | None = None
    # (H, W, 4) as `NormalBend.texture` has it.
    bend: Array | None = None

    def channel(self, field: str, lobe: int = 1) -> Array:
        """(H, W, components), or (H, W) for one component."""
        name = field if field in ("emission", "ambient_occlusion") else lobe_channel(field, lobe)
        if name in self.channels:
            values = self.channels[name]
        else:
            neutral = np.array(CHANNEL_BY_NAME[name].neutral)
            values = np.broadcast_to(neutral, (*self.hit.shape, len(neutral)))
        return values[..., 0] if values.shape[-1] == 1 else values

    @property
    def toward_viewer(self) -> Array:
        """(H, W, 3) unit vectors towards the viewer."""
        toward = self.eye - self.position[..., :3] * float(self.perspective)
        return np.asarray(toward / np.linalg.norm(toward, axis=-1, keepdims=True))

    @property
    def hit(self) -> NDArray[np.bool_]:
        """(H, W) where a surface is seen."""
        return np.asarray(self.position[..., 3] > 0.0)

    def without(self, *fields: str) -> Surfaces:
        """The same with these fields neutral in every lobe."""
        kept = {
            name: values
            for name, values in self.channels.items()
            if CHANNEL_BY_NAME[name].field not in fields
        }
        return Surfaces(
            self.origin, self.eye, self.perspective, self.position, self.geometric_normal,
            kept, self.lobes,
        )  # fmt: skip

    @property
    def layout(self) -> SurfaceLayout:
        """Every channel that is given varies."""
        table = [channel.name for channel in channels_of(self.lobes)]
        stored = ("depth", *(name for name in table if name in self.channels))
        return SurfaceLayout(ChannelPlan(stored, {}, ("a material",), lobes=self.lobes))

    def upload(self) -> SurfaceBuffer:
        """The same on the GPU."""
        height, width, _ = self.position.shape
        layout = self.layout
        planes = np.zeros((height, width, 4 * layout.texture_count), dtype=np.float32)
        for place, (name, component) in enumerate(layout.values):
            planes[..., place] = self.channels[name][..., component]
        return SurfaceBuffer(
            width,
            height,
            self.origin,
            self.eye,
            self.perspective,
            texture_from_array(self.position.astype(np.float32), "RGBA32F"),
            texture_from_array(self.geometric_normal.astype(np.float32), "RGBA32F"),
            tuple(
                texture_from_array(planes[..., 4 * i : 4 * i + 4], "RGBA32F")
                for i in range(layout.texture_count)
            ),
            texture_from_array(np.zeros((1, 8, 4), dtype=np.float32), "RGBA32F"),
            layout,
            None if self.objects is None else _number_texture(self.objects + 1),
            bend=None if self.bend is None else _bend(self.bend),
        )


def _bend(values: Array) -> NormalBend:
    """Of a single sample."""
    texture = texture_from_array(values.astype(np.float32), "RGBA32F")
    return NormalBend(None, texture, texture, np.zeros(4), 0.0, {1: texture})  # type: ignore[arg-type]


def _number_texture(numbers: NDArray[np.int64]) -> Texture:
    return texture_from_array(numbers[..., None].astype(np.float32), "R32F")


def _exact(values: Array) -> Array:
    return values.astype(np.float32).astype(np.float64)


def _unit(values: Array) -> Array:
    return np.asarray(values / np.linalg.norm(values, axis=-1, keepdims=True))


def surfaces(
    position: NDArray[np.float64],
    normal: NDArray[np.float64],
    *,
    eye: tuple[float, float, float] = (0.0, 0.0, 10.0),
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    albedo: float = 1.0,
) -> Surfaces:
    """Diffuse surfaces at (H, W, 3) local positions; everything else neutral."""
    shape = (*position.shape[:2], 3)
    one = np.ones((*shape[:2], 1))
    normals = np.broadcast_to(normal, shape)
    return Surfaces(
        origin=np.array(origin),
        eye=np.array(eye),
        perspective=True,
        position=_exact(np.concatenate([position, one], axis=-1)),
        geometric_normal=_exact(np.concatenate([normals, one], axis=-1)),
        channels={
            "normal": _exact(normals),
            "diffuse_color": _exact(np.full(shape, albedo)),
        },
    )


def random_surfaces(
    seed: int, size: int = 96, perspective: bool = True, lobes: int = 1
) -> Surfaces:
    """Everything a surface can be, within a few metres of the origin: normals bent from the
    geometric one, some beyond the viewer's horizon; roughness 0 and 1; pixels without surface.
    With more than one lobe also all that few materials have: the other distributions, edge
    tints, rough diffuse, light that comes through, and weights by the view."""
    rng = np.random.default_rng(seed)
    shape = (size, size)
    position = rng.uniform(-2.0, 2.0, (*shape, 3))
    eye = np.array([0.5, -6.0, 2.0])
    toward = eye - position if perspective else np.broadcast_to(eye, position.shape)
    Ng = _unit(rng.normal(size=(*shape, 3)))
    Ng = np.where((Ng * toward).sum(-1, keepdims=True) < 0.0, -Ng, Ng)
    hit = (rng.random((*shape, 1)) > 0.05).astype(np.float64)
    channels = {
        "emission": rng.random((*shape, 3)) * 10.0,
        "ambient_occlusion": rng.random((*shape, 1)),
    }
    for lobe in range(1, lobes + 1):
        fields = _random_lobe(rng, shape, Ng)
        if lobes > 1:
            fields |= _random_extras(rng, shape, fields["specular_f0"])
        channels |= {lobe_channel(field, lobe): values for field, values in fields.items()}
    return Surfaces(
        origin=np.array([100.0, -50.0, 20.0]),
        eye=_exact(eye),
        perspective=perspective,
        position=_exact(np.concatenate([position, hit * 1.0], axis=-1)),
        geometric_normal=_exact(np.concatenate([Ng, hit], axis=-1)),
        channels={name: _exact(values) for name, values in channels.items()},
        lobes=lobes,
    )


def _random_lobe(rng: np.random.Generator, shape: tuple[int, int], Ng: Array) -> dict[str, Array]:
    roughness = rng.random((*shape, 1))
    roughness[:4], roughness[4:8], roughness[8:12] = 0.0, 1.0, 0.02
    layer_f0 = 0.2 * rng.random((*shape, 1)) * (rng.random((*shape, 1)) < 0.6)
    layer_f90 = np.where(layer_f0 > 0.0, np.maximum(layer_f0, rng.random((*shape, 1))), 0.0)
    f0 = rng.random((*shape, 3)) * 0.8
    return {
        "normal": _unit(Ng + 0.4 * rng.normal(size=(*shape, 3))),
        "diffuse_color": rng.random((*shape, 3)),
        "layer_f0": layer_f0,
        "layer_f90": layer_f90,
        "specular_f0": f0,
        "specular_f90": f0 + rng.random((*shape, 3)) * (1.0 - f0),
        "dielectric": rng.random((*shape, 1)),
        "roughness": roughness,
    }


def _random_extras(rng: np.random.Generator, shape: tuple[int, int], f0: Array) -> dict[str, Array]:
    one = (*shape, 1)
    curve = rng.integers(0, 5, one).astype(np.float64)
    parameter = np.where(curve == 2.0, 3.0 * rng.random(one), 0.3 * rng.random(one))
    return {
        "diffuse_roughness": rng.random(one) * (rng.random(one) < 0.7),
        "diffuse_share": 1.0 - 0.9 * rng.random(one),
        "specular_share": 1.0 - 0.9 * rng.random(one),
        "specular_dip": 4.0 * rng.random((*shape, 3)) * f0,
        "distribution": rng.integers(0, 7, one).astype(np.float64),
        "diffuse_model": rng.integers(0, 2, one).astype(np.float64),
        "aspect": np.where(rng.random(one) < 0.5, 1.0, 0.3 + rng.random(one)),
        "tangent": _unit(rng.normal(size=(*shape, 3))),
        "translucent_color": rng.random((*shape, 3)) * (rng.random(one) < 0.5),
        "sheen_color": rng.random((*shape, 3)) * (rng.random(one) < 0.5),
        "sheen_roughness": rng.random(one),
        "view_base": rng.random(one),
        "view_slope": (1.0 - rng.random(one)) * (curve > 0.0),
        "view_curve": curve,
        "view_parameter": parameter,
        "view_roughness": rng.random(one),
    }
