# SPDX-License-Identifier: GPL-3.0-or-later
"""How the channels of a scene lie in the texels of GPU textures, and the GLSL that unpacks them.

Both are made from the channel table and the plan, so a shader reads exactly what was baked.
Every component takes the least that keeps its error out of sight:

- normals are two numbers of 16 bits (see `octahedral`);
- material numbers take 8 bits while they fit, else 16;
- albedos and reflectances take 8 bits, as the square root of their share of the largest that their
  material has. The root spreads the steps as a display does, so the error is at most half a step
  of 255 beside that material's brightest texel, whatever light falls on it;
- ambient occlusion takes 8 bits, as the square root: in a room with a window all light may come
  through a hundredth of the hemisphere, and there the root's steps shrink as its rays' noise does;
- all else is half, and float32 where half does not hold it (see `precision`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from ..scene.octahedral import GLSL as OCTAHEDRAL_GLSL
from ..scene.octahedral import to_codes
from .channels import CHANNEL_BY_NAME, Channel
from .plan import ChannelPlan

# Depth is tested in every search and has a texture of its own.
_APART = "depth"

_OCCLUSION = "ambient_occlusion"

Kind = Literal["8", "16", "16F", "32F"]
TexelFormat = Literal[
    "R8", "RG8", "RGBA8", "R16", "RG16", "RGBA16",
    "R16F", "RG16F", "RGBA16F", "R32F", "RG32F", "RGBA32F",
]  # fmt: skip

# Fields in which light is linear, and which are never below 0.
_REFLECTANCES = {
    "diffuse_color", "layer_f0", "layer_f90", "specular_f0", "specular_f90", "dielectric",
    "sheen_color", "translucent_color",
}  # fmt: skip

# Numbers of these kinds are stored as shares of the largest.
_LARGEST_CODE = {"8": 255, "16": 65535}
_LETTERS = {1: "R", 2: "RG", 3: "RGBA", 4: "RGBA"}


@dataclass(frozen=True)
class PackedTexture:
    """Up to four components in one texture: (channel, component) for each of them."""

    texture_format: TexelFormat
    components: tuple[tuple[str, int], ...]

    @property
    def width(self) -> int:
        """Components that the format has; it may have one more than are used."""
        return {"R": 1, "RG": 2, "RGBA": 4}[self.texture_format.rstrip("0123456789F")]

    @property
    def bytes(self) -> int:
        """Of one texel."""
        bits = {"8": 8, "16": 16, "16F": 16, "32F": 32}[self.texture_format.lstrip("RGBA")]
        return self.width * bits // 8


@dataclass(frozen=True)
class Packing:
    """Where each stored component lies.

    Attributes:
        plan: the scene's channels.
        wide: channels that half precision is named for, but does not hold in this scene.
    """

    plan: ChannelPlan
    wide: frozenset[str] = frozenset()

    @property
    def stored(self) -> tuple[str, ...]:
        """The packed channels."""
        return tuple(name for name in self.plan.stored if name != _APART)

    @property
    def scaled(self) -> tuple[str, ...]:
        """Channels that are stored as shares of the largest value that their material has."""
        return tuple(name for name in self.stored if self._is_share(name))

    def _is_share(self, name: str) -> bool:
        return CHANNEL_BY_NAME[name].field in _REFLECTANCES and name not in self.wide

    def _kind(self, name: str) -> Kind:
        if name == "material_id":
            return "8" if len(self.plan.material_names) <= _LARGEST_CODE["8"] else "16"
        if CHANNEL_BY_NAME[name].is_direction:
            return "16"
        if name in self.wide:
            return "32F"
        if name == _OCCLUSION or self._is_share(name):
            return "8"
        return "16F" if CHANNEL_BY_NAME[name].precision == "half" else "32F"

    def _packed_components(self, name: str) -> int:
        return 2 if CHANNEL_BY_NAME[name].is_direction else self.plan.components(name)

    @cached_property
    def textures(self) -> tuple[PackedTexture, ...]:
        """The stored components, four to a texture, each kind of number apart."""
        kinds: tuple[Kind, ...] = ("8", "16", "16F", "32F")
        packed = []
        for kind in kinds:
            components = [
                (name, index)
                for name in self.stored
                if self._kind(name) == kind
                for index in range(self._packed_components(name))
            ]
            for i in range(0, len(components), 4):
                some = tuple(components[i : i + 4])
                packed.append(PackedTexture(_format(len(some), kind), some))
        return tuple(packed)

    @property
    def texel_bytes(self) -> int:
        """What a texel takes on the GPU, depth not included."""
        return sum(texture.bytes for texture in self.textures)

    def pack(
        self,
        channels: Mapping[str, NDArray[np.float32]],
        texture: PackedTexture,
        scale: Mapping[str, NDArray[np.float32]],
    ) -> NDArray[np.float32]:
        """(H, W, width) float32 of one texture from channels of (H, W, components).

        Args:
            channels: a framebuffer's.
            texture: one of `textures`.
            scale: for each name in `scaled`, (H, W): the largest value that the texel's
                material has anywhere.
        """
        names = dict.fromkeys(name for name, _ in texture.components)
        coded = {name: self._coded(name, channels[name], scale) for name in names}
        side = next(iter(coded.values())).shape[:2]
        pixels = np.zeros((*side, texture.width), dtype=np.float32)
        for slot, (name, component) in enumerate(texture.components):
            pixels[..., slot] = coded[name][..., component]
        return pixels

    def _coded(
        self,
        name: str,
        values: NDArray[np.float32],
        scale: Mapping[str, NDArray[np.float32]],
    ) -> NDArray[np.float32]:
        """A channel's values as the sampler gives them back."""
        if CHANNEL_BY_NAME[name].is_direction:
            return to_codes(values).astype(np.float32) / np.float32(_LARGEST_CODE["16"])
        if name == "material_id":
            return values / np.float32(_LARGEST_CODE[self._kind(name)])
        if self._is_share(name):
            largest = scale[name][..., None]
            share = values / np.where(largest > 0.0, largest, np.float32(1.0))
            return np.sqrt(np.maximum(share, 0.0))
        if name == _OCCLUSION:
            return np.sqrt(np.maximum(values, 0.0))
        return values

    def glsl(self, scale_row: Mapping[str, tuple[int, int]], *, shifts: bool = False) -> str:
        """The struct CachedSurface, and the functions that read, blend and clear it.

        `read_cached(ivec3 texel)` reads all of a texel, `read_identity` only what tells whose
        surface it is. Fields that are not stored are not in the struct, but for material_id.

        Args:
            scale_row: for each name in `scaled`, row and component of the material table.
            shifts: whether `scale_shift`, an int that the caller sets, is added to these rows.
        """
        shift = " + scale_shift" if shifts else ""
        rows = {name: (f"{row}{shift}", slot) for name, (row, slot) in scale_row.items()}
        fields = [CHANNEL_BY_NAME[name] for name in self.stored if name != "material_id"]
        lines = ["int scale_shift = 0;"] if shifts else []
        lines += [OCTAHEDRAL_GLSL, "struct CachedSurface {", "  float material_id;"]
        lines += [f"  {self.glsl_type(c)} {c.name};" for c in fields]
        lines += ["};", ""]
        lines += self._reader("read_cached", fields, rows)
        identity = [c for c in fields if c.name == "normal"]
        lines += self._reader("read_identity", identity, rows)
        lines += ["void add_surface(inout CachedSurface sum, CachedSurface s, float weight)", "{"]
        lines += [f"  sum.{c.name} += weight * s.{c.name};" for c in fields]
        lines += ["}", "", "void clear_surface(out CachedSurface s)", "{", "  s.material_id = 0.0;"]
        lines += [f"  s.{c.name} = {self.glsl_type(c)}(0.0);" for c in fields]
        lines += ["}", "", "void forget_directions(inout CachedSurface s)", "{"]
        lines += [f"  s.{c.name} = vec3(0.0);" for c in fields if c.is_direction]
        return "\n".join([*lines, "}", ""])

    def _reader(
        self, function: str, fields: list[Channel], scale_row: Mapping[str, tuple[str, int]]
    ) -> list[str]:
        names = {channel.name for channel in fields} | {"material_id"}
        place = {
            component: f"t{index}.{'xyzw'[slot]}"
            for index, texture in enumerate(self.textures)
            for slot, component in enumerate(texture.components)
        }
        read = [
            index
            for index, texture in enumerate(self.textures)
            if any(name in names for name, _ in texture.components)
        ]
        lines = [f"CachedSurface {function}(ivec3 texel)", "{", "  CachedSurface s;"]
        lines += [f"  vec4 t{index} = texelFetch(cache_{index}, texel, 0);" for index in read]
        lines.append(f"  s.material_id = {self._material_id(place)};")
        for channel in fields:
            parts = [
                place[channel.name, index] for index in range(self._packed_components(channel.name))
            ]
            lines.append(f"  s.{channel.name} = {self._unpacked(channel, parts, scale_row)};")
        return [*lines, "  return s;", "}", ""]

    def _material_id(self, place: Mapping[tuple[str, int], str]) -> str:
        if "material_id" not in self.stored:
            return repr(float((self.plan.constant("material_id") or (0.0,))[0]))
        part = place["material_id", 0]
        return f"floor({part} * {_LARGEST_CODE[self._kind('material_id')]}.0 + 0.5)"

    def _unpacked(
        self, channel: Channel, parts: list[str], scale_row: Mapping[str, tuple[str, int]]
    ) -> str:
        together = f"vec{len(parts)}({', '.join(parts)})" if len(parts) > 1 else parts[0]
        if channel.is_direction:
            return f"octahedral_normal({together})"
        if self._is_share(channel.name):
            row, component = scale_row[channel.name]
            scale = f"material_value(int(s.material_id), {row}).{'xyzw'[component]}"
            return f"{together} * {together} * {scale}"
        if channel.name == _OCCLUSION:
            return f"{together} * {together}"
        return together

    def glsl_type(self, channel: Channel) -> str:
        """The type of a channel as it is stored."""
        components = self.plan.components(channel.name)
        return "float" if components == 1 else f"vec{components}"


def _format(components: int, kind: Kind) -> TexelFormat:
    return cast("TexelFormat", _LETTERS[components] + kind)


def make_packing(plan: ChannelPlan, wide: Iterable[frozenset[str]] = ()) -> Packing:
    """The packing of the channels that a plan stores.

    Args:
        plan: of the cache.
        wide: `DeepFramebuffer.wide` of every framebuffer that is to be packed.
    """
    return Packing(plan, frozenset().union(*wide))
