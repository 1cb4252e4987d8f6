# SPDX-License-Identifier: GPL-3.0-or-later
"""Uniform blocks reach the shader as they were given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from addon.glsl.uniforms import Field, UniformBlock

BLOCK = UniformBlock(
    "test_values",
    (
        Field("float", "first"),
        Field("vec2", "pair"),
        Field("mat4", "transform"),
        Field("vec4", "table", 3),
        Field("int", "number"),
        Field("ivec4", "numbers"),
    ),
)


def values() -> dict[str, object]:
    return {
        "first": 0.5,
        "pair": (1.5, -2.5),
        "transform": np.arange(16.0).reshape(4, 4),
        "table": np.arange(12.0).reshape(3, 4) * 10.0,
        "number": -7,
        "numbers": (1, 2, 3, 4),
    }


def test_offsets_follow_std140() -> None:
    # By the rules of OpenGL 4.5, 7.6.2.2: vec2 on 8 bytes, matrices and arrays on 16.
    fields = BLOCK.dtype.fields
    assert fields is not None
    offsets = {name: fields[name][1] for name in BLOCK.dtype.names or ()}
    assert offsets == {
        "first": 0, "pair": 8, "transform": 16, "table": 80, "number": 128, "numbers": 144,
    }  # fmt: skip
    assert BLOCK.dtype.itemsize == 160


def test_matrices_are_stored_by_columns() -> None:
    packed = BLOCK.pack(values()).tobytes()
    stored = np.frombuffer(packed[16:80], dtype="<f4").reshape(4, 4)
    assert np.array_equal(stored, np.arange(16.0).reshape(4, 4).T)


def test_a_missing_or_unknown_field_is_named() -> None:
    wrong = values()
    wrong["wide"] = wrong.pop("pair")
    with pytest.raises(KeyError, match=r"pair.*wide"):
        BLOCK.pack(wrong)


def test_a_value_beyond_float32_is_refused() -> None:
    with pytest.raises(ValueError, match="first is not finite"), np.errstate(over="ignore"):
        BLOCK.pack({**values(), "first": 1e300})


def test_arrays_that_would_be_padded_are_refused() -> None:
    with pytest.raises(ValueError, match="std140"):
        Field("float", "list", 4)


def test_the_shader_reads_what_was_packed(
    gpu_context: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from addon.glsl import shader

    real = shader._FOLDER
    (tmp_path / "passes").mkdir()
    for name in ("fullscreen_vert", "probe"):
        text = (
            (real / "passes" / "fullscreen_vert.glsl").read_text()
            if name == "fullscreen_vert"
            else """
            void main() {
              result = test_values.transform * vec4(1.0, 2.0, 3.0, 1.0)
                     + vec4(test_values.first, test_values.pair.y, test_values.table[2].w,
                            float(test_values.number + test_values.numbers.z));
            }"""
        )
        (tmp_path / "passes" / f"{name}.glsl").write_text(text)
    monkeypatch.setattr(shader, "_FOLDER", tmp_path)
    shader.source.cache_clear()
    try:
        program = shader.PassShader(
            name="probe", fragment="probe", outputs=(("VEC4", "result"),), blocks=(BLOCK,)
        ).build()
    finally:
        shader.source.cache_clear()
    target = shader.texture_2d(3, 2)
    program.draw_fullscreen(shader.framebuffer([target]), {}, {"test_values": values()})
    expected = np.arange(16.0).reshape(4, 4) @ [1, 2, 3, 1] + [0.5, -2.5, 110.0, -4.0]
    assert np.array_equal(shader.read_texture(target)[1, 2], expected.astype(np.float32))


def test_unknown_textures_are_named(gpu_context: None) -> None:
    from addon.corrmap.raster_program import build_raster_program
    from addon.glsl import shader
    from addon.relight.shadows.shadow_pass import _PASS

    program = build_raster_program(_PASS, with_cutouts=False).opaque
    assert program is not None
    with pytest.raises(KeyError, match="ghost"):
        program.bind({"ghost": shader.texture_2d(1, 1)}, {})


@pytest.mark.parametrize("layers", [0, 3])
def test_textures_keep_their_values(gpu_context: None, layers: int) -> None:
    from addon.glsl import shader

    shape = (4, 5, 4) if not layers else (layers, 4, 5, 4)
    pixels = np.random.default_rng(1).normal(size=shape).astype(np.float32)
    texture = shader.texture_from_array(pixels, "RGBA32F")
    if not layers:
        assert np.array_equal(shader.read_texture(texture), pixels)
    with pytest.raises(ValueError, match="R32F"):
        shader.texture_from_array(pixels, "R32F")
