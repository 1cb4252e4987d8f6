# SPDX-License-Identifier: GPL-3.0-or-later
"""A file is there whole or not at all, and what hindered it is said in one sentence."""

from __future__ import annotations

import errno
import os
import resource
import stat
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from addon.camplace.cameras_file import write_cameras
from addon.errors import InputError
from addon.whole_file import replacing
from addon.writable import require_file
from tools.picture_file import write_exr, write_png


def begin_and_raise(path: Path, error: BaseException) -> None:
    with replacing(path) as part:
        part.write_text("half of")
        raise error


def test_the_new_file_takes_the_old_ones_place_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "note.txt"
    path.write_text("old")
    with replacing(path) as part:
        part.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["note.txt"]


def test_it_reaches_the_disk_before_it_is_renamed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And its new name is on the disk when the block ends."""
    path, flushed = tmp_path / "note.txt", []

    def note(number: int) -> None:
        what = "folder" if stat.S_ISDIR(os.fstat(number).st_mode) else os.fstat(number).st_size
        flushed.append((what, path.exists()))

    monkeypatch.setattr("os.fsync", note)
    with replacing(path) as part:
        part.write_text("new")
    assert flushed == [(3, False), ("folder", True)]


def test_file_systems_that_do_not_flush_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They say that they cannot; others say that the disk is broken, and that is told."""
    path, flush, answer = tmp_path / "note.txt", os.fsync, errno.EINVAL

    def refuse(number: int) -> None:
        if stat.S_ISDIR(os.fstat(number).st_mode):
            raise OSError(answer, os.strerror(answer))
        flush(number)

    monkeypatch.setattr("os.fsync", refuse)
    with replacing(path) as part:
        part.write_text("new")
    assert path.read_text() == "new"
    answer = errno.EIO
    with pytest.raises(InputError, match="Input/output error"), replacing(path) as part:
        part.write_text("newer")


def test_no_two_writers_have_one_temporary_name(tmp_path: Path) -> None:
    """Not even with one process number, as containers on one disk have."""
    path = tmp_path / "note.txt"
    with replacing(path) as mine, replacing(path) as theirs:
        assert mine != theirs
        mine.write_text("mine")
        theirs.write_text("theirs")
    assert path.read_text() == "mine"


@pytest.mark.parametrize("error", [KeyboardInterrupt(), ValueError("a mistake")])
def test_what_ends_the_block_is_passed_on_and_leaves_nothing(
    tmp_path: Path, error: BaseException
) -> None:
    with pytest.raises(type(error)):
        begin_and_raise(tmp_path / "note.txt", error)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        (errno.ENOSPC, "the disk is full; free some space"),
        (errno.EDQUOT, "the disk is full; free some space"),
        (errno.EROFS, "Read-only file system; choose another place"),
    ],
)
def test_refusals_are_one_sentence(tmp_path: Path, code: int, reason: str) -> None:
    with pytest.raises(InputError, match=rf"note\.txt cannot be written: {reason}") as caught:
        begin_and_raise(tmp_path / "note.txt", OSError(code, os.strerror(code)))
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", [".", "/"])
def test_a_folder_is_no_place_for_a_file(path: str) -> None:
    with pytest.raises(InputError, match="it is a folder"), replacing(Path(path)):
        pytest.fail("there is nothing to write")


def test_a_link_stays_and_what_it_leads_to_is_replaced(tmp_path: Path) -> None:
    for folder in ("here", "there"):
        (tmp_path / folder).mkdir()
    link, note = tmp_path / "here" / "link.txt", tmp_path / "there" / "note.txt"
    link.symlink_to(Path("..", "there", "note.txt"))
    for text in ("new", "newer"):  # there is nothing at its end at first
        require_file(link)
        with replacing(link) as part:
            part.write_text(text)
        assert note.read_text() == text
        assert link.is_symlink()
    assert [p.name for p in (*link.parent.iterdir(), *note.parent.iterdir())] == [
        "link.txt",
        "note.txt",
    ]


def test_what_is_no_file_is_refused_and_stays(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "circle").symlink_to("circle")
    for name, reason in (("pipe", "not a regular file"), ("circle", "symbolic links")):
        path = tmp_path / name
        with pytest.raises(InputError, match=f"{name} cannot be written: .*{reason}"):
            require_file(path)
        with pytest.raises(InputError, match=reason), replacing(path):
            pytest.fail("there is nothing to write")
    assert {p.name for p in tmp_path.iterdir()} == {"pipe", "circle"}


def test_a_library_that_wrote_nothing_and_said_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"), replacing(tmp_path / "note.txt"):
        pass


def test_a_librarys_own_words_when_the_disk_is_well(tmp_path: Path) -> None:
    message = r"cannot be written: no such codec; choose"
    with pytest.raises(InputError, match=message):
        begin_and_raise(tmp_path / "note.txt", RuntimeError("no such\ncodec"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("where", ["/dev/full", "limit"])
@pytest.mark.parametrize(
    "write",
    [
        lambda path: write_exr(path, np.random.default_rng(0).random((64, 64, 3), np.float32)),
        lambda path: write_png(path, np.random.default_rng(0).random((64, 64, 3))),
        lambda path: write_cameras(path, ()),
    ],
)
def test_every_writer_says_that_the_disk_is_full(
    tmp_path: Path, write: Callable[[Path], None], where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    monkeypatch.setattr("secrets.token_hex", lambda count: "token")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    if where == "limit":
        # A few bytes fit, then no more: what a disk does that fills up.
        resource.setrlimit(resource.RLIMIT_FSIZE, (16, limits[1]))
        message = "cannot be written: File too large"
    else:
        path.with_name(f".file.token.{os.getpid()}.part").symlink_to("/dev/full")
        message = "cannot be written: the disk is full"
    try:
        with pytest.raises(InputError, match=message):
            write(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
