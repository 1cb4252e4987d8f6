# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders for temporary files: those of programs that were killed go, and no others."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from addon import temporary_folder
from addon.errors import InputError
from addon.temporary_folder import TemporaryFolder

ROOT = Path(__file__).resolve().parent.parent

_HOLDER = """
import sys
from addon.temporary_folder import TemporaryFolder
folder = TemporaryFolder()
(folder.path / "picture.exr").write_bytes(b"half")
print(folder.path, flush=True)
sys.stdin.read()
"""


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for temporary files, in which every folder is old enough to go."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(temporary_folder, "_YOUNG_S", -1.0)
    return tmp_path


def killed(place: Path, while_it_lives: Callable[[Path], None] = lambda _: None) -> Path:
    """The folder of a process that was killed."""
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-c", _HOLDER], cwd=ROOT, stdin=pipe, stdout=pipe, text=True
    ) as process:
        assert process.stdout is not None
        folder = Path(process.stdout.readline().strip())
        assert folder.parent == place
        while_it_lives(folder)
        process.send_signal(signal.SIGKILL)
    return folder


def test_a_folder_goes_with_its_block_and_is_held_until_then(place: Path) -> None:
    with TemporaryFolder() as folder:
        (folder / "deep").mkdir()
        (folder / "deep" / "file").touch()
        with TemporaryFolder() as other:
            assert other != folder
        assert (folder / "deep" / "file").exists()
    assert list(place.iterdir()) == []
    held = TemporaryFolder()
    held.remove()
    held.remove()
    assert list(place.iterdir()) == []


def test_what_a_killed_process_left_goes_with_the_next_one(place: Path) -> None:
    def next_one(folder: Path) -> None:
        with TemporaryFolder():
            assert (folder / "picture.exr").exists()

    folder = killed(place, next_one)
    assert (folder / "picture.exr").exists()
    with TemporaryFolder():
        assert not folder.exists()


def test_young_folders_stay(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between its making and its being held, a folder is nobody's for a moment."""
    folder = killed(place)
    monkeypatch.setattr(temporary_folder, "_YOUNG_S", 120.0)
    with TemporaryFolder():
        assert folder.exists()
    old = folder.stat().st_mtime - 121.0
    os.utime(folder / ".held", (old, old))
    with TemporaryFolder():
        assert not folder.exists()


def test_what_is_not_ones_own_stays(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = killed(place)
    with monkeypatch.context() as patch:
        patch.setattr(temporary_folder, "_user", lambda: os.getuid() + 1)
        with TemporaryFolder():
            assert folder.exists()
    elsewhere = place / "elsewhere"
    folder.rename(elsewhere)
    (place / "relume-link").symlink_to(elsewhere)
    (place / "relume-file").touch()
    (place / "relume-of-somebody").mkdir()
    before = sorted(place.iterdir())
    with TemporaryFolder():
        pass
    assert sorted(place.iterdir()) == before
    assert (elsewhere / "picture.exr").exists()


def test_no_place_for_temporary_files(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(place / "gone"))
    with pytest.raises(InputError, match="TMPDIR"):
        TemporaryFolder()
