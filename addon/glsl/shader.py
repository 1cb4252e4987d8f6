# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds GPU shaders from the files beside it, and draws with them."""

from __future__ import annotations

import atexit
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, ClassVar, Literal, cast

import gpu
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .texture_pool import TexturePool
from .uniforms import UniformBlock

_FOLDER = Path(__file__).parent

SamplerType = Literal["FLOAT_2D", "FLOAT_2D_ARRAY", "DEPTH_2D", "DEPTH_2D_ARRAY"]
Samplers = tuple[tuple[str, SamplerType], ...]
GlslType = Literal["FLOAT", "VEC2", "VEC3", "VEC4", "INT"]
Texture = gpu.types.GPUTexture
TextureFormat = Literal[
    "R8", "RG8", "RGBA8", "R16", "RG16", "RGBA16",
    "R16F", "RG16F", "RGBA16F", "R32F", "RG32F", "RGBA32F", "DEPTH_COMPONENT32F",
]  # fmt: skip


@cache
def source(path: str) -> str:
    """The text of a shader file under addon/glsl/."""
    return (_FOLDER / path).read_text(encoding="utf-8")


@dataclass(frozen=True)
class Varying:
    """A value handed from the vertex to the fragment shader."""

    qualifier: Literal["smooth", "flat", "no_perspective"]
    glsl_type: GlslType
    name: str


@dataclass(frozen=True)
class PassShader:
    """All that a pass's shader is made of.

    Attributes:
        name: for messages, and the prefix of its interface.
        fragment, vertex: files under addon/glsl/passes/, without the suffix.
        library: files under addon/glsl/lib/, in order of dependence; one that is named again is
            there once.
        vertex_library: likewise, those that the vertex stage needs.
        blocks: uniform blocks, bound in this order.
        samplers: name -> type, bound in this order.
        vertex_in: (GLSL type, name), in order.
        varyings: from vertex to fragment shader.
        outputs: (GLSL type, name), in the order of the framebuffer's colour slots.
        defines: preprocessor names and values; only what the scene requires is compiled.
        generated: GLSL made by the caller (an unpacking function, say), before the library.
        writes_depth: whether the fragment shader sets gl_FragDepth.
    """

    name: str
    fragment: str
    outputs: tuple[tuple[GlslType, str], ...]
    vertex: str = "fullscreen_vert"
    library: tuple[str, ...] = ()
    vertex_library: tuple[str, ...] = ()
    blocks: tuple[UniformBlock, ...] = ()
    samplers: Samplers = ()
    vertex_in: tuple[tuple[GlslType, str], ...] = (("VEC2", "corner"),)
    varyings: tuple[Varying, ...] = ()
    defines: tuple[tuple[str, str], ...] = ()
    generated: str = ""
    writes_depth: bool = False

    def build(self) -> ShaderProgram:
        """Compile, or give what was compiled from the same description before.

        Needs a current GPU context. Programs live as long as the process: they are few, and
        with Blender 5.2's OpenGL back end, where a shader was freed before the batches that it
        had drawn, batches made in between were now and then drawn blank.
        """
        known = _programs.get(self)
        if known is None:
            _announce(self)
            known = _programs[self] = ShaderProgram(self)
        return known


_programs: dict[PassShader, ShaderProgram] = {}

# Before Blender takes its GPU context down.
atexit.register(_programs.clear)


class UncompiledError(Exception):
    """A shader is about to be compiled, which may take a second: somebody wants to say so first.

    Attributes:
        name: of the shader.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.name = name


class _Announcements:
    """Which shaders were announced already, while somebody listens."""

    wanted = False
    made: ClassVar[set[PassShader]] = set()


@contextmanager
def announced_compilation() -> Iterator[None]:
    """Inside, `PassShader.build` raises `UncompiledError` once for each shader that it has not
    compiled, and compiles it when it is asked again."""
    _Announcements.wanted = True
    try:
        yield
    finally:
        _Announcements.wanted = False


def _announce(description: PassShader) -> None:
    if _Announcements.wanted and description not in _Announcements.made:
        _Announcements.made.add(description)
        raise UncompiledError(description.name)


class ShaderProgram:
    """A compiled `PassShader`. Keeps the uniform buffers it binds alive."""

    def __init__(self, description: PassShader) -> None:
        self.description = description
        info = gpu.types.GPUShaderCreateInfo()
        for name, value in dict.fromkeys(description.defines):
            info.define(name, value)
        info.typedef_source("".join(block.declaration() for block in description.blocks))
        for slot, block in enumerate(description.blocks):
            info.uniform_buf(slot, block.struct_name, block.name)
        for slot, (name, sampler_type) in enumerate(description.samplers):
            info.sampler(slot, sampler_type, name)
        for slot, (glsl_type, name) in enumerate(description.vertex_in):
            info.vertex_in(slot, glsl_type, name)
        if description.varyings:
            interface = gpu.types.GPUStageInterfaceInfo(f"{description.name}_interface")
            for varying in description.varyings:
                getattr(interface, varying.qualifier)(varying.glsl_type, varying.name)
            info.vertex_out(interface)
        for slot, (glsl_type, name) in enumerate(description.outputs):
            info.fragment_out(slot, glsl_type, name)
        if description.writes_depth:
            info.depth_write("ANY")
        vertex = [
            *_library(description.vertex_library),
            source(f"passes/{description.vertex}.glsl"),
        ]
        info.vertex_source("\n".join(vertex))
        fragment = [
            *_library(description.library),
            description.generated,
            source(f"passes/{description.fragment}.glsl"),
        ]
        info.fragment_source("\n".join(fragment))
        self.shader = gpu.shader.create_from_info(info)
        self._buffers: dict[str, Any] = {}

    def bind(self, textures: Mapping[str, Any], uniforms: Mapping[str, Mapping[str, Any]]) -> None:
        """Bind the shader with all its textures and blocks; each must be given, no other may.

        Raises:
            KeyError: a texture or block is missing or unknown.
        """
        wanted = {name for name, _ in self.description.samplers}
        blocks = {block.name: block for block in self.description.blocks}
        odd = (wanted ^ set(textures)) | (set(blocks) ^ set(uniforms))
        if odd:
            raise KeyError(f"pass {self.description.name}: missing or unknown: {sorted(odd)}")
        self.shader.bind()
        for name, block in blocks.items():
            self.shader.uniform_block(name, self._updated(block, block.pack(uniforms[name])))
        for name, texture in textures.items():
            self.shader.uniform_sampler(name, texture)

    def _updated(self, block: UniformBlock, data: NDArray[np.uint8]) -> Any:
        # A buffer of its own for every bind: with one that is overwritten, a draw call that
        # the driver has not yet run would read the values of the next.
        buffer = gpu.types.GPUUniformBuf(gpu.types.Buffer("UBYTE", len(data), cast("Any", data)))
        self._buffers[block.name] = buffer
        return buffer

    @cached_property
    def _fullscreen(self) -> Any:
        layout = gpu.types.GPUVertFormat()
        layout.attr_add(id="corner", comp_type="F32", len=2, fetch_mode="FLOAT")
        corners = gpu.types.GPUVertBuf(layout, 3)
        corners.attr_fill("corner", [(-1.0, -1.0), (3.0, -1.0), (-1.0, 3.0)])
        return gpu.types.GPUBatch(type="TRIS", buf=corners)

    def draw_fullscreen(
        self,
        framebuffer: Any,
        textures: Mapping[str, Any],
        uniforms: Mapping[str, Mapping[str, Any]],
    ) -> None:
        """Run the fragment shader once for every pixel of `framebuffer`."""
        self.draw_batch(self._fullscreen, framebuffer, textures, uniforms)

    def draw_batch(
        self,
        batch: Any,
        framebuffer: Any,
        textures: Mapping[str, Any],
        uniforms: Mapping[str, Mapping[str, Any]],
    ) -> None:
        """Draw a batch's triangles over what `framebuffer` holds, whatever their depth."""
        with framebuffer.bind():
            gpu.state.depth_test_set("NONE")
            gpu.state.depth_mask_set(False)
            self.bind(textures, uniforms)
            batch.draw(self.shader)


def _library(names: tuple[str, ...]) -> list[str]:
    """The texts of library files, each once."""
    return [source(f"lib/{name}.glsl") for name in dict.fromkeys(names)]


@contextmanager
def adding() -> Iterator[None]:
    """Inside, what passes draw is added to what is there, alpha too."""
    gpu.state.blend_set("ADDITIVE_PREMULT")
    try:
        yield
    finally:
        gpu.state.blend_set("NONE")


def texture_2d(width: int, height: int, texture_format: TextureFormat = "RGBA32F") -> Any:
    """An empty GPU texture; its contents are undefined until drawn or cleared.

    Raises:
        InputError: it is larger than the GPU's textures can be, or there is no room for it.
    """
    largest = max_texture_width()
    if max(width, height) > largest:
        raise InputError(
            f"this GPU's pictures have at most {largest} pixels along a side, not "
            f"{width}x{height}; choose a smaller size"
        )

    def make() -> Any:
        return gpu.types.GPUTexture((width, height), format=texture_format)

    try:
        if _in_software():
            return _pool.take(width, height, texture_format, make)
        return make()
    except RuntimeError as error:
        raise InputError(
            f"the GPU has no room for a picture of {width}x{height}; choose a smaller size, or "
            "free some of its memory"
        ) from error


def texture_array(side: int, layers: int, texture_format: TextureFormat) -> Any:
    """An empty array texture of square layers; its contents are undefined until drawn.

    Raises:
        InputError: there is no room for it.
    """
    try:
        return gpu.types.GPUTexture((side, side), layers=layers, format=texture_format)
    except RuntimeError as error:
        raise InputError(
            f"the GPU has no room for {layers * side**2 / 1e6:.0f} million texels of the cache; "
            "place fewer cameras, bake at a lower preset, or free some of its memory"
        ) from error


def texture_from_array(pixels: NDArray[np.float32], texture_format: TextureFormat) -> Any:
    """A GPU texture from (H, W, C) or, for an array texture, (layers, H, W, C) float32."""
    components = pixels.shape[-1]
    # The buffer is a view of the array, which lives until the texture has its copy.
    values = np.ascontiguousarray(pixels, dtype=np.float32).ravel()
    buffer = gpu.types.Buffer("FLOAT", values.size, values)
    expected = {"R": 1, "RG": 2, "RGBA": 4}[texture_format.rstrip("0123456789F")]
    if components != expected:
        raise ValueError(f"{texture_format} takes {expected} components, got {components}")
    if pixels.ndim == 4:
        layers, height, width, _ = pixels.shape
        return gpu.types.GPUTexture(
            (width, height), layers=layers, format=texture_format, data=buffer
        )
    height, width, _ = pixels.shape
    return gpu.types.GPUTexture((width, height), format=texture_format, data=buffer)


def read_texture(texture: Any) -> NDArray[np.float32]:
    """A 2D texture's pixels: (H, W, C) float32, row 0 at the bottom."""
    pixels = np.asarray(texture.read(), dtype=np.float32)
    return pixels.reshape(texture.height, texture.width, -1).copy()


# Colour slots of Blender's `gpu.types.GPUFrameBuffer`, fewer than most GPUs have.
MAX_COLOR_SLOTS = 6


def max_texture_layers() -> int:
    """Layers that an array texture may have."""
    return int(gpu.capabilities.max_texture_layers_get())


def max_texture_width() -> int:
    """Texels that a texture may have along a side."""
    return int(gpu.capabilities.max_texture_size_get())


def max_textures() -> int:
    """Textures that a fragment shader may read."""
    return int(gpu.capabilities.max_textures_frag_get())


def draws_in_software() -> bool:
    """Whether what draws is no GPU but a program that stands for one."""
    return str(gpu.platform.device_type_get()) == "SOFTWARE"


@cache
def _in_software() -> bool:
    return draws_in_software()


_pool = TexturePool()
atexit.register(_pool.clear)


def framebuffer(color: Sequence[Any], depth: Any = None) -> Any:
    """A framebuffer over the given textures."""
    return gpu.types.GPUFrameBuffer(color_slots=tuple(color), depth_slot=depth)


def layer_framebuffer(texture: Any, layer: int) -> Any:
    """A framebuffer over one layer of an array texture."""
    slot: Any = {"texture": texture, "layer": layer}
    return gpu.types.GPUFrameBuffer(color_slots=(slot,))
