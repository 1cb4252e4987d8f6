# SPDX-License-Identifier: GPL-3.0-or-later
"""How the channels of a scene lie in GPU textures, and the GLSL that unpacks them.

Both are made from the channel table and the channels that this scene stores, so a shader
reads exactly what was baked: channels that do not vary are constants in its text.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .channels import CHANNEL_BY_NAME, CHANNELS, Channel, Precision

# Depth is tested in every search and has a texture of its own.
_APART = "depth"


@dataclass(frozen=True)
class PackedTexture:
    """Up to four components in one texture: (channel, component) for each of them."""

    texture_format: Literal["RGBA16F", "RGBA32F"]
    components: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Packing:
    """Where each stored component lies.

    Attributes:
        stored: channels that vary over the scene, depth not among them.
        constants: the value of each of the other channels, everywhere.
        wide: channels that half precision is named for, but does not hold in this scene.
    """

    stored: tuple[str, ...]
    constants: Mapping[str, tuple[float, ...]]
    wide: frozenset[str] = frozenset()

    @cached_property
    def textures(self) -> tuple[PackedTexture, ...]:
        """The stored components, four to a texture, half precision apart from float32."""
        formats: dict[Precision, Literal["RGBA16F", "RGBA32F"]] = {
            "half": "RGBA16F",
            "float32": "RGBA32F",
        }
        packed = []
        for precision, texture_format in formats.items():
            components = [
                (channel.name, index)
                for channel in CHANNELS
                if channel.name in self.stored and self._precision(channel) == precision
                for index in range(channel.components)
            ]
            packed += [
                PackedTexture(texture_format, tuple(components[i : i + 4]))
                for i in range(0, len(components), 4)
            ]
        return tuple(packed)

    def _precision(self, channel: Channel) -> Precision:
        return "float32" if channel.name in self.wide else channel.precision

    def pack(
        self, channels: Mapping[str, NDArray[np.float32]], texture: PackedTexture
    ) -> NDArray[np.float32]:
        """(H, W, 4) float32 of one texture from channels of (H, W, components)."""
        first = channels[texture.components[0][0]]
        pixels = np.zeros((*first.shape[:2], 4), dtype=np.float32)
        for slot, (name, component) in enumerate(texture.components):
            pixels[..., slot] = channels[name][..., component]
        return pixels

    def glsl(self) -> str:
        """The struct CachedSurface, and the functions that read and blend it.

        `unpack_surface(vec4 packed[])` takes one texel of each texture, in order.
        """
        fields = [channel for channel in CHANNELS if channel.name != _APART]
        place = {
            component: (index, "xyzw"[slot])
            for index, texture in enumerate(self.textures)
            for slot, component in enumerate(texture.components)
        }
        lines = ["struct CachedSurface {"]
        lines += [f"  {_glsl_type(channel)} {channel.name};" for channel in fields]
        lines += ["};", "", f"#define PACKED_COUNT {max(1, len(self.textures))}", ""]
        lines += ["CachedSurface unpack_surface(vec4 texels[PACKED_COUNT])", "{"]
        lines += ["  CachedSurface s;"]
        for channel in fields:
            lines.append(f"  s.{channel.name} = {self._expression(channel, place)};")
        lines += ["  return s;", "}", ""]
        return "\n".join(lines)

    def _expression(
        self, channel: Channel, place: Mapping[tuple[str, int], tuple[int, str]]
    ) -> str:
        if channel.name in self.stored:
            values = [
                f"texels[{place[channel.name, i][0]}].{place[channel.name, i][1]}"
                for i in range(channel.components)
            ]
        else:
            constant = self.constants.get(channel.name, channel.neutral)
            values = [_glsl_float(value) for value in constant]
        if channel.components == 1:
            return values[0]
        return f"{_glsl_type(channel)}({', '.join(values)})"


def _glsl_type(channel: Channel) -> str:
    return "float" if channel.components == 1 else f"vec{channel.components}"


def _glsl_float(value: float) -> str:
    """A float32's shortest exact decimal, with the point that GLSL wants."""
    text = repr(float(np.float32(value)))
    return text if any(mark in text for mark in ".e") else f"{text}.0"


def make_packing(
    stored: Sequence[str],
    constants: Mapping[str, tuple[float, ...]],
    wide: Iterable[frozenset[str]] = (),
) -> Packing:
    """The packing of the channels that a plan stores.

    Args:
        stored: their names.
        constants: the values of others.
        wide: `DeepFramebuffer.wide` of every framebuffer that is to be packed.

    Raises:
        KeyError: a name that is not in the channel table.
    """
    for name in (*stored, *constants):
        CHANNEL_BY_NAME[name]
    return Packing(
        tuple(name for name in stored if name != _APART),
        dict(constants),
        frozenset().union(*wide),
    )
