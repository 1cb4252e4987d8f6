# SPDX-License-Identifier: GPL-3.0-or-later
"""Uniforms declared once: one list of fields gives the GLSL struct and the packed bytes.

Blender's push constants hold 128 bytes on Vulkan, so every pass takes its values through
std140 uniform blocks (OpenGL 4.5 specification, 7.6.2.2).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

# GLSL type -> (numpy base, shape, std140 alignment in bytes). vec3 is left out on purpose:
# its 12 bytes on a 16-byte alignment are read differently by some drivers.
_TYPES: dict[str, tuple[str, tuple[int, ...], int]] = {
    "float": ("<f4", (), 4),
    "int": ("<i4", (), 4),
    "vec2": ("<f4", (2,), 8),
    "vec4": ("<f4", (4,), 16),
    "ivec4": ("<i4", (4,), 16),
    "mat4": ("<f4", (4, 4), 16),
}


@dataclass(frozen=True)
class Field:
    """One member of a block; `count` > 0 makes it an array (16-byte types only)."""

    glsl_type: str
    name: str
    count: int = 0

    def __post_init__(self) -> None:
        if self.glsl_type not in _TYPES:
            raise ValueError(f"{self.name}: no std140 layout for GLSL type {self.glsl_type}")
        if self.count and _TYPES[self.glsl_type][2] != 16:
            raise ValueError(f"{self.name}: arrays of {self.glsl_type} waste std140 space")


@dataclass(frozen=True)
class UniformBlock:
    """A named std140 block. In GLSL its fields read `name.field`."""

    name: str
    fields: tuple[Field, ...]

    @property
    def struct_name(self) -> str:
        """The GLSL struct's name: the block's, in CamelCase."""
        return "".join(part.capitalize() for part in self.name.split("_")) + "Block"

    def declaration(self) -> str:
        """GLSL source of the struct."""
        lines = [
            f"  {field.glsl_type} {field.name}{f'[{field.count}]' if field.count else ''};"
            for field in self.fields
        ]
        return "\n".join([f"struct {self.struct_name} {{", *lines, "};", ""])

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """The block as a numpy structured type with std140 offsets."""
        names, formats, offsets = [], [], []
        offset = 0
        for field in self.fields:
            base, shape, alignment = _TYPES[field.glsl_type]
            offset = -(-offset // alignment) * alignment
            full_shape = (field.count, *shape) if field.count else shape
            names.append(field.name)
            formats.append((base, full_shape))
            offsets.append(offset)
            offset += np.dtype((base, full_shape)).itemsize
        itemsize = -(-offset // 16) * 16
        return np.dtype(
            {"names": names, "formats": formats, "offsets": offsets, "itemsize": itemsize}
        )

    def pack(self, values: Mapping[str, Any]) -> NDArray[np.uint8]:
        """The block's bytes. Matrices are given as numpy writes them (row by row) and are
        stored column by column. Arrays may be shorter than declared.

        Raises:
            KeyError: a field is missing or unknown.
            ValueError: a value is not finite in float32.
        """
        known = {field.name for field in self.fields}
        if known != set(values):
            odd = ", ".join(sorted(known ^ set(values)))
            raise KeyError(f"block {self.name}: missing or unknown fields: {odd}")
        packed = np.zeros((), dtype=self.dtype)
        for field in self.fields:
            value = np.asarray(values[field.name])
            if field.glsl_type == "mat4":
                value = np.swapaxes(value, -1, -2)
            target = packed[field.name]
            if field.count:
                target[: len(value)] = value
            else:
                packed[field.name] = value
            if target.dtype.kind == "f" and not np.isfinite(packed[field.name]).all():
                raise ValueError(f"block {self.name}: {field.name} is not finite in float32")
        return np.frombuffer(packed.tobytes(), dtype=np.uint8)
