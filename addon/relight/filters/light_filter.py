# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands in a light's beam: the parts of the light pass that only some lights have.

A filter multiplies the light by a colour that depends on the place it lights, in light space. The
light pass is compiled with those filters alone that a light uses: each brings its GLSL, its fields
in the uniform block `filters` and its textures.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...glsl.shader import Samplers
from ...glsl.uniforms import Field, UniformBlock
from ...scene.light import Light


@dataclass(frozen=True)
class LightFilter:
    """One filter of one light.

    Attributes:
        name: `vec3 <name>_filter(vec3 q)` in addon/glsl/lib/<name>_filter.glsl gives what it lets
            through to q (light space, metres).
        fields: its fields in the block `filters`, with its name and "_" in front.
        values: their values.
        samplers, textures: what it reads, by names that begin likewise.
        by_count: gives further values, for the number of samples that the light has in all.
        library: files under addon/glsl/lib/ that its own needs, in order of dependence.
    """

    name: str
    fields: tuple[Field, ...]
    values: Mapping[str, Any]
    samplers: Samplers = ()
    textures: Mapping[str, Any] = field(default_factory=dict)
    library: tuple[str, ...] = ()
    by_count: Callable[[int], Mapping[str, Any]] | None = None


@dataclass(frozen=True)
class FilterKind:
    """What of a filter is compiled: not its values."""

    name: str
    fields: tuple[Field, ...]
    samplers: Samplers
    library: tuple[str, ...]


FilterKinds = tuple[FilterKind, ...]


def kinds(filters: Sequence[LightFilter]) -> FilterKinds:
    """What a shader depends on of some filters."""
    return tuple(FilterKind(f.name, f.fields, f.samplers, f.library) for f in filters)


def filter_library(used: FilterKinds) -> tuple[str, ...]:
    """The files under addon/glsl/lib/ that some filters need, each once."""
    files = (file for kind in used for file in (*kind.library, f"{kind.name}_filter"))
    return tuple(dict.fromkeys(files))


# The fields that every light with filters has: the rows of light space's axes, and its origin.
_SPACE = (
    Field("vec4", "light_x"),
    Field("vec4", "light_y"),
    Field("vec4", "light_z"),
    Field("vec4", "light_origin"),
)


def filter_samplers(used: FilterKinds) -> Samplers:
    """What some filters read."""
    return tuple(sampler for kind in used for sampler in kind.samplers)


def filter_blocks(used: FilterKinds) -> tuple[UniformBlock, ...]:
    """The uniform block of some filters; none without filters."""
    if not used:
        return ()
    fields = (field for kind in used for field in kind.fields)
    return (UniformBlock("filters", (*_SPACE, *fields)),)


def filter_glsl(used: FilterKinds) -> str:
    """`vec3 light_filters(vec3 position)`, of local space: all of them together; nothing without
    filters."""
    if not used:
        return ""
    lines = [
        "vec3 light_filters(vec3 position)",
        "{",
        "  vec3 from_light = position - filters.light_origin.xyz;",
        "  vec3 q = vec3(dot(filters.light_x.xyz, from_light),",
        "                dot(filters.light_y.xyz, from_light),",
        "                dot(filters.light_z.xyz, from_light));",
        "  vec3 through = vec3(1.0);",
        *(f"  through *= {kind.name}_filter(q);" for kind in used),
        "  return through;",
        "}",
        "",
    ]
    return "\n".join(lines)


def filter_textures(filters: Sequence[LightFilter]) -> dict[str, Any]:
    """The textures of `filter_samplers`."""
    return {name: texture for each in filters for name, texture in each.textures.items()}


def filter_uniforms(
    light: Light, filters: Sequence[LightFilter], local_origin: NDArray[np.float64], count: int
) -> dict[str, dict[str, Any]]:
    """The values of `filter_blocks` for surfaces in the space around `local_origin`.

    `count` is of how many of the light's samples this is one.
    """
    if not filters:
        return {}
    axes = np.zeros((3, 4))
    axes[:, :3] = light.axes
    values: dict[str, Any] = {
        "light_x": axes[0],
        "light_y": axes[1],
        "light_z": axes[2],
        "light_origin": np.append(light.position - local_origin, 0.0),
    }
    for each in filters:
        values.update(each.values)
        if each.by_count is not None:
            values.update(each.by_count(count))
    return {"filters": values}
