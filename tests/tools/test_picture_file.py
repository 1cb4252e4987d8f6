# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures survive the way to the disk and back; damaged ones are named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from addon.errors import InputError
from tools.picture_file import read_picture, write_exr, write_png


@pytest.fixture
def rgb() -> np.ndarray:
    return np.random.default_rng(3).normal(0.5, 2.0, (12, 20, 3)).astype(np.float32)


def test_exr_keeps_every_bit_the_rows_and_the_extras(tmp_path: Path, rgb: np.ndarray) -> None:
    path = tmp_path / "picture.exr"
    write_exr(path, rgb, {"guide.depth": rgb[..., 1]}, {"relumePixelSize": 0.25})
    found = read_picture(path)
    assert found.linear
    np.testing.assert_array_equal(found.rgb, rgb)
    np.testing.assert_array_equal(found.extra["guide.depth"], rgb[..., 1])
    assert dict(found.header) == {"relumePixelSize": 0.25}
    assert [p.name for p in tmp_path.iterdir()] == ["picture.exr"]  # no part file left


def test_png_keeps_8_bit_levels_and_the_rows(tmp_path: Path) -> None:
    levels = np.random.default_rng(4).integers(0, 256, (12, 20, 3))
    write_png(tmp_path / "picture.png", levels / 255.0)
    found = read_picture(tmp_path / "picture.png")
    assert not found.linear
    np.testing.assert_array_equal(np.rint(found.rgb * 255.0), levels)


def test_a_missing_picture_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no picture .*absent\.exr"):
        read_picture(tmp_path / "absent.exr")


@pytest.mark.parametrize("name", ["bad.exr", "bad.png"])
@pytest.mark.parametrize("content", [b"", b"v/1\x01", b"\x89PNG\r\n\x1a\n", b"nothing of the kind"])
def test_damaged_pictures_are_named(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=name):
        read_picture(tmp_path / name)


@pytest.mark.parametrize("kind", ["exr", "png"])
def test_truncated_pictures_are_named(tmp_path: Path, rgb: np.ndarray, kind: str) -> None:
    path = tmp_path / f"short.{kind}"
    write_exr(path, rgb) if kind == "exr" else write_png(path, np.clip(rgb, 0, 1))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(InputError, match="short"):
        read_picture(path)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_counted(
    tmp_path: Path, rgb: np.ndarray, value: float
) -> None:
    rgb[2, 3] = value
    rgb[5, 6, 1] = value
    write_exr(tmp_path / "burnt.exr", rgb)
    with pytest.raises(InputError, match=r"burnt\.exr has 2 of \d+ pixels that are not finite"):
        read_picture(tmp_path / "burnt.exr")
    write_exr(tmp_path / "ash.exr", np.full_like(rgb, value))
    with pytest.raises(InputError, match=r"ash\.exr has no pixel that is finite"):
        read_picture(tmp_path / "ash.exr")


@pytest.mark.parametrize(("name", "write"), [("a.exr", write_exr), ("a.png", write_png)])
def test_nothing_is_left_where_writing_fails(
    tmp_path: Path, name: str, write: Callable[[Path, np.ndarray], None]
) -> None:
    (tmp_path / name).mkdir()  # a folder stands where the file should be
    with pytest.raises(InputError, match="cannot be written"):
        write(tmp_path / name, np.zeros((4, 4, 3), dtype=np.float32))
    assert [p.name for p in tmp_path.iterdir()] == [name]
