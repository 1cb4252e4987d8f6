# SPDX-License-Identifier: GPL-3.0-or-later
"""How a `SurfaceBuffer` holds the channels of a scene, and the GLSL that writes and reads it.

What varies over a material's texels lies in the buffer's textures, as float32. What is constant
over a material is read from the material table, by the material of the triangle that is seen;
what is constant over the scene is a number in the shader's text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..caching.channels import CHANNEL_BY_NAME, LOBE_FIELDS, Channel, lobe_channel
from ..caching.plan import ChannelPlan
from ..glsl.shader import Samplers, SamplerType, source

# Textures that a pass reads beside the surfaces' values: position, normal, material table, three
# albedo tables; of a light how normals turn, its shadow map, the objects seen and their weights, of
# the world two.
OTHER_TEXTURES = 10

# What a pass declares that reads `SurfaceBuffer.objects`.
OBJECT_SAMPLER: tuple[str, SamplerType] = ("surface_object", "FLOAT_2D")

# Rows of the material table that one edit takes; see surface_edit.glsl.
EDIT_ROWS = 3

# Fields of the struct Lobe in addon/glsl/lib/surface.glsl, by the channel table's names.
_GLSL_FIELDS = {
    "normal": "N",
    "layer_f0": "layer.x",
    "layer_f90": "layer.y",
    "specular_f0": "f0",
    "specular_f90": "f90",
    "specular_dip": "dip",
}


@dataclass(frozen=True)
class SurfaceLayout:
    """Where the channels of a plan lie in a `SurfaceBuffer` and in the material table.

    Attributes:
        plan: of the cache.
        edit_row: first row of the material table with what is edited about each material; None
            where nothing is, and shaders know of no edits.
        edits_objects: whether rows behind it say what is edited about each object.
    """

    plan: ChannelPlan
    edit_row: int | None = None
    edits_objects: bool = False

    @cached_property
    def values(self) -> tuple[tuple[str, int], ...]:
        """(channel, component) of all that is stored for each pixel, four to a texture."""
        return tuple(
            (name, index)
            for name in self.plan.stored
            if name not in ("depth", "material_id")
            for index in range(self.plan.components(name))
        )

    @property
    def texture_count(self) -> int:
        """Textures that hold them."""
        return -(-len(self.values) // 4)

    @cached_property
    def constants(self) -> tuple[tuple[str, int], ...]:
        """(channel, component) of what is constant over each material."""
        return tuple(
            (name, index)
            for name in self.plan.material_constants
            for index in range(CHANNEL_BY_NAME[name].components)
        )

    @property
    def constant_row(self) -> int:
        """The material table's first row of `constants`; before it are the means of `values`."""
        return self.texture_count

    @property
    def mesh_normal_row(self) -> int:
        """The material table's row behind them: which of the `mesh_normals` the mesh gives (1) and
        which the texels (0), if there are any."""
        return self.constant_row - (-len(self.constants) // 4)

    @property
    def mesh_normals(self) -> tuple[str, ...]:
        """The stored normals that the mesh gives in some materials; four at most, as lobes."""
        return tuple(name for name, every in self.plan.mesh_normals.items() if any(every))

    @property
    def scale_row(self) -> int:
        """The material table's first row behind that."""
        return self.mesh_normal_row + bool(self.mesh_normals)

    @property
    def value_names(self) -> tuple[str, ...]:
        """The textures' names in shaders."""
        return tuple(f"surface_values_{i}" for i in range(self.texture_count))

    @property
    def samplers(self) -> Samplers:
        """What a pass declares that reads the surfaces with `read_glsl`."""
        values: Samplers = tuple((name, "FLOAT_2D") for name in self.value_names)
        return (
            ("surface_position", "FLOAT_2D"),
            ("surface_geometric_normal", "FLOAT_2D"),
            ("material_table", "FLOAT_2D"),
            *values,
            *(((OBJECT_SAMPLER,)) if self.edits_objects else ()),
        )

    @cached_property
    def defines(self) -> tuple[tuple[str, str], ...]:
        """Preprocessor names for the parts of the lobes that this scene has."""
        parts = {
            "HAS_SPECULAR": ("specular_f0", "specular_f90", "layer_f0", "layer_f90"),
            "HAS_DIP": ("specular_dip",),
            "HAS_DISTRIBUTION": ("distribution",),
            "HAS_ASPECT": ("aspect",),
            "HAS_ROUGH_DIFFUSE": ("diffuse_roughness",),
            "HAS_DIFFUSE_MODEL": ("diffuse_model",),
            "HAS_TRANSLUCENT": ("translucent_color",),
            "HAS_SHEEN": ("sheen_color",),
            "HAS_VIEW_WEIGHT": ("view_slope", "view_base"),
        }
        lobes = range(1, self.plan.lobes + 1)
        used = [
            (define, "1")
            for define, fields in parts.items()
            if any(self.plan.uses(lobe_channel(field, k)) for field in fields for k in lobes)
        ]
        return (("SURFACE_LOBES", str(self.plan.lobes)), *used)

    def has(self, define: str) -> bool:
        """Whether a name is among `defines`."""
        return any(name == define for name, _ in self.defines)

    def write_glsl(self) -> str:
        """`write_values(CachedSurface, int column, vec3 n)` and `write_means(int column, vec3 n)`,
        for the outputs in `value_names`, where n is the normal that the mesh interpolates.

        Directions are made unit; where they cancelled, n takes their place, as it does for a
        material's mean (a tangent along n is none: see bsdf.glsl), and wherever a material's normal
        is the mesh's own."""
        normals = [name for name in self.plan.stored if CHANNEL_BY_NAME[name].is_direction]
        lines = ["void write_values(CachedSurface s, int column, vec3 n)", "{"]
        for name in normals:
            lines.append(f"  float size_{name} = dot(s.{name}, s.{name});")
            lines.append(
                f"  s.{name} = size_{name} > 0.0 ? s.{name} * inversesqrt(size_{name}) : n;"
            )
        if self.mesh_normals:
            lines.append(f"  vec4 of_mesh = material_value(column, {self.mesh_normal_row});")
        for slot, name in enumerate(self.mesh_normals):
            lines.append(f"  s.{name} = of_mesh.{'xyzw'[slot]} > 0.5 ? n : s.{name};")
        lines += [
            f"  {texture} = vec4({', '.join(self._components(i, 's.'))});"
            for i, texture in enumerate(self.value_names)
        ]
        lines += ["}", "", "void write_means(int column, vec3 n)", "{"]
        for i, texture in enumerate(self.value_names):
            lines.append(f"  {texture} = material_value(column, {i});")
            for slot, (name, index) in enumerate(self.values[4 * i : 4 * i + 4]):
                if name in normals:
                    lines.append(f"  {texture}.{'xyzw'[slot]} = n.{'xyz'[index]};")
        return "\n".join([*lines, "}", ""])

    def mean_glsl(self) -> str:
        """`write_mean(ivec2 texel, float share, vec3 n)`, for the outputs in `value_names`: what
        textures named sum_... hold, times `share`; directions are unit as from `write_glsl`."""
        normals = [name for name in self.plan.stored if CHANNEL_BY_NAME[name].is_direction]
        lines = ["void write_mean(ivec2 texel, float share, vec3 n)", "{"]
        for i, texture in enumerate(self.value_names):
            lines.append(f"  vec4 v{i} = share * texelFetch(sum_{texture}, texel, 0);")
        for name in normals:
            place = [self._value_place[name, index] for index in range(3)]
            parts = ", ".join(f"v{at // 4}.{'xyzw'[at % 4]}" for at in place)
            lines.append(f"  vec3 {name} = vec3({parts});")
            lines.append(f"  float size_{name} = dot({name}, {name});")
            lines.append(f"  {name} = size_{name} > 0.0 ? {name} * inversesqrt(size_{name}) : n;")
            lines += [
                f"  v{at // 4}.{'xyzw'[at % 4]} = {name}.{'xyz'[index]};"
                for index, at in enumerate(place)
            ]
        lines += [f"  {texture} = v{i};" for i, texture in enumerate(self.value_names)]
        return "\n".join([*lines, "}", ""])

    @property
    def textures_with_mesh_normals(self) -> tuple[int, ...]:
        """Which of the values' textures hold one of `mesh_normals`."""
        places = [self._value_place[name, i] for name in self.mesh_normals for i in range(3)]
        return tuple(sorted({place // 4 for place in places}))

    def mesh_normals_glsl(self, textures: Sequence[int]) -> str:
        """`write_mesh_normals(ivec2 texel, int column, vec3 n)`, for some of the outputs in
        `value_names`: what textures named mean_... hold, but n wherever the mesh gives it."""
        lines = ["void write_mesh_normals(ivec2 texel, int column, vec3 n)", "{"]
        lines.append(f"  vec4 of_mesh = material_value(column, {self.mesh_normal_row});")
        for i in textures:
            name = self.value_names[i]
            lines.append(f"  {name} = texelFetch(mean_{name}, texel, 0);")
        for slot, name in enumerate(self.mesh_normals):
            for index in range(3):
                texture, component = divmod(self._value_place[name, index], 4)
                if texture in textures:
                    target = f"{self.value_names[texture]}.{'xyzw'[component]}"
                    given = f"of_mesh.{'xyzw'[slot]} > 0.5"
                    lines.append(f"  {target} = {given} ? n.{'xyz'[index]} : {target};")
        return "\n".join([*lines, "}", ""])

    def _components(self, texture: int, prefix: str) -> list[str]:
        some = self.values[4 * texture : 4 * texture + 4]
        parts = [
            f"{prefix}{name}" + (f".{'xyz'[index]}" if self.plan.components(name) > 1 else "")
            for name, index in some
        ]
        return parts + ["0.0"] * (4 - len(parts))

    def read_glsl(self) -> str:
        """`unpack_surface`, which surface.glsl declares."""
        names = [] if self.edit_row is None else ["surface_edit"]
        names += ["object_edit"] if self.edits_objects else []
        lines = [
            *(source(f"lib/{name}.glsl") for name in names),
            "void unpack_surface(ivec2 texel, int column, inout Surface surface)",
            "{",
        ]
        lines += [
            f"  vec4 v{i} = texelFetch({name}, texel, 0);"
            for i, name in enumerate(self.value_names)
        ]
        rows = self.mesh_normal_row - self.constant_row
        lines += [f"  vec4 m{i} = material_value(column, {self.constant_row + i});"
                  for i in range(rows)]  # fmt: skip
        for name in ("emission", "ambient_occlusion"):
            lines.append(f"  surface.{name} = {self._value(CHANNEL_BY_NAME[name])};")
        for lobe in range(self.plan.lobes):
            for field in LOBE_FIELDS:
                channel = CHANNEL_BY_NAME[lobe_channel(field, lobe + 1)]
                target = _GLSL_FIELDS.get(field, field)
                lines.append(f"  surface.lobes[{lobe}].{target} = {self._value(channel)};")
        if self.edit_row is not None:
            lines.append(f"  SurfaceEdit edit = read_edit(column, {self.edit_row});")
            if self.edits_objects:
                first = self.edit_row + EDIT_ROWS
                lines.append(f"  edit = joined(edit, read_object_edit(texel, {first}));")
            lines.append("  edit_surface(surface, edit);")
        return "\n".join([*lines, "}", ""])

    def _value(self, channel: Channel) -> str:
        """A channel's value as GLSL of its full type."""
        constant = self.plan.constant(channel.name)
        if constant is not None:
            parts = [glsl_float(value) for value in constant]
        else:
            name = self.plan.same.get(channel.name, channel.name)
            place, letter = (
                (self._constant_place, "m")
                if name in self.plan.material_constants
                else (self._value_place, "v")
            )
            count = channel.components if letter == "m" else self.plan.components(name)
            parts = []
            for index in range(count):
                position = place[name, index]
                parts.append(f"{letter}{position // 4}.{'xyzw'[position % 4]}")
        if channel.components == 1:
            return parts[0]
        return f"vec3({', '.join(parts)})"

    @cached_property
    def _value_place(self) -> Mapping[tuple[str, int], int]:
        return {component: position for position, component in enumerate(self.values)}

    @cached_property
    def _constant_place(self) -> Mapping[tuple[str, int], int]:
        return {component: position for position, component in enumerate(self.constants)}


def glsl_float(value: float) -> str:
    """A float32's shortest exact decimal, with the point that GLSL wants."""
    text = repr(float(np.float32(value)))
    return text if any(mark in text for mark in ".e") else f"{text}.0"
