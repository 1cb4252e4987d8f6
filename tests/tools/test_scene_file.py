# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with a .blend is said before, or as, Blender reads it."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from addon.errors import InputError
from tools.scene_file import check_blend, open_scene


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"BLEND", "is not a .blend"),
        (b"\x89PNG\r\n\x1a\n" + bytes(64), "is not a .blend"),
        (b"\x1f\x8b" + bytes(8), "is not a .blend"),  # broken gzip
        # Without the time, which workers of one run would see differently in the tests' names.
        (gzip.compress(b"another kind of file", mtime=0), "is not a .blend"),
        (gzip.compress(b"", mtime=0), "is empty"),
    ],
)
def test_files_of_another_kind_are_named(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "scene.blend"
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"scene\.blend {words}"):
        check_blend(path)


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no file .*absent\.blend"):
        check_blend(tmp_path / "absent.blend")
    with pytest.raises(InputError, match="is not a file"):
        check_blend(tmp_path)


def test_every_way_in_which_blender_saves_is_taken(tmp_path: Path) -> None:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.name = "Kept"
    plain, zstd = tmp_path / "plain.blend", tmp_path / "zstd.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(plain), compress=False)
    bpy.ops.wm.save_as_mainfile(filepath=str(zstd), compress=True)
    old = tmp_path / "gzip.blend"  # as Blender compressed before 3.0
    old.write_bytes(gzip.compress(plain.read_bytes()))
    starts = {path.read_bytes()[:2] for path in (plain, zstd, old)}
    assert len(starts) == 3
    for path in (plain, zstd, old):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        assert open_scene(path).name == "Kept"


@pytest.mark.parametrize("compress", [False, True])
def test_a_truncated_file_is_named_once(
    tmp_path: Path, compress: bool, capfd: pytest.CaptureFixture[str]
) -> None:
    import bpy

    bpy.ops.wm.read_factory_settings()
    path = tmp_path / "short.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=compress)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    with pytest.raises(InputError, match=r"short\.blend cannot be opened \(Missing DNA") as caught:
        open_scene(path)
    assert str(caught.value).count("short.blend") == 1
    assert "Error" not in "".join(capfd.readouterr())
