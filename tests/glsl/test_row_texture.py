# SPDX-License-Identifier: GPL-3.0-or-later
"""Long rows of values come back from where the shaders look for them, or are refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from addon.errors import InputError
from addon.glsl import row_texture as module
from addon.glsl.row_texture import ROW_BITS, ROW_WIDTH, row_texture
from addon.glsl.shader import read_texture


@pytest.mark.parametrize("count", [0, 1, ROW_WIDTH - 1, ROW_WIDTH, ROW_WIDTH + 1, 3 * ROW_WIDTH])
def test_values_lie_row_by_row(gpu_context: None, count: int) -> None:
    values = np.random.default_rng(count).random((count, 2)).astype(np.float32)
    texels = read_texture(row_texture(values, "RG32F", "numbers"))
    assert texels.shape == (max(-(-count // ROW_WIDTH), 1), ROW_WIDTH, 2)
    number = np.arange(count)
    found = texels[number >> ROW_BITS, number & (ROW_WIDTH - 1)]
    np.testing.assert_array_equal(found, values)
    assert not texels.reshape(-1, 2)[count:].any()


def test_more_than_a_texture_has_rows(gpu_context: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "max_texture_width", lambda: 2)
    row_texture(np.zeros((2 * ROW_WIDTH, 1)), "R32F", "numbers")
    with pytest.raises(InputError, match=r"the table of numbers takes 8193 texels.* room for 8192"):
        row_texture(np.zeros((2 * ROW_WIDTH + 1, 1)), "R32F", "numbers")


def test_shaders_know_the_width_by_its_name_alone() -> None:
    bare = re.compile(rf"\b({ROW_WIDTH}|{ROW_WIDTH - 1})\b|(<<|>>) *{ROW_BITS}\b")
    folder = Path(module.__file__).parent
    texts = {path.name: path.read_text(encoding="utf-8") for path in folder.rglob("*.glsl")}
    assert texts
    assert not [name for name, text in texts.items() if bare.search(text)]
