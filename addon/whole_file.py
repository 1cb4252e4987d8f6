# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are on the disk whole or not at all."""

from __future__ import annotations

import errno
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError

# A quota that is used up is a full disk to whoever writes.
_FULL = frozenset({errno.ENOSPC, errno.EDQUOT})

# What file systems that do not flush folders answer.
_CANNOT_FLUSH = frozenset({errno.EINVAL, errno.EBADF, errno.ENOTSUP, errno.ENOSYS})

# More than what a nearly full disk may still have room for in a file's last block.
_TRIAL_BYTES = 1 << 20


@contextmanager
def replacing(path: Path, remedy: str = "choose another place") -> Iterator[Path]:
    """A temporary path; the file written there takes the place of `path` when the block ends.

    The file reaches the disk before it is renamed, so that a reader finds the old file or the
    new one, whatever happens in between. When the block raises, nothing is left of it.

    Args:
        path: the file; an existing one is replaced, and where it is a link, what that leads to.
        remedy: what to do if it cannot be written, for the error.

    Raises:
        InputError: as `temporary_beside`; or there is something other than a file.
    """
    place = place_of(path, remedy)
    with temporary_beside(path, remedy) as temporary:
        yield temporary
        flush_file(temporary)
        put_in_place(temporary, place)


@contextmanager
def temporary_beside(path: Path, remedy: str = "choose another place") -> Iterator[Path]:
    """A temporary path in the folder of `path`; what is still there when the block ends goes.

    No other process, on this computer or another one, gets the same. It ends with this process's
    number, by which whoever kills it finds what it was writing.

    Raises:
        InputError: the block raised an OSError, or a RuntimeError, which is what libraries that
            write files raise.
    """
    place = Path(os.path.realpath(path))
    # Processes on two computers, or in two containers, may have one number.
    temporary = place.with_name(f".{place.name}.{secrets.token_hex(4)}.{os.getpid()}.part")
    with write_errors(path, remedy):
        try:
            yield temporary
        except RuntimeError as error:
            raise _cause(temporary, error) from error
        finally:
            temporary.unlink(missing_ok=True)


def flush_file(path: Path) -> None:
    """Wait until a file's contents are on the disk. Raises OSError."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def put_in_place(temporary: Path, place: Path) -> None:
    """Rename a flushed file, in one step that is on the disk when this returns. Raises OSError."""
    temporary.replace(place)
    flush_folder(place.parent)


def flush_folder(folder: Path) -> None:
    """Wait until a folder's list of names is on the disk, where the system can be asked for that.

    Raises:
        OSError: the disk could not take it.
    """
    try:
        number = os.open(folder, os.O_RDONLY)
    except PermissionError:  # Windows opens no folders; a folder may be written and not read
        return
    try:
        os.fsync(number)
    except OSError as error:
        if error.errno not in _CANNOT_FLUSH:
            raise
    finally:
        os.close(number)


def place_of(path: Path, remedy: str = "choose another place") -> Path:
    """Where a file for `path` is to be put: there, or where it leads to as a link.

    Raises:
        InputError: a folder, a device or anything else that is no file is there.
    """
    place = Path(os.path.realpath(path))
    with write_errors(path, remedy):
        try:
            mode = place.stat().st_mode
        except FileNotFoundError:
            return place
    if stat.S_ISREG(mode):
        return place
    what = "it is a folder" if stat.S_ISDIR(mode) else "it is not a regular file"
    raise InputError(f"{path} cannot be written: {what}; {remedy}")


@contextmanager
def write_errors(path: Path, remedy: str = "choose another place") -> Iterator[None]:
    """Turns the operating system's refusals to write `path` into one clear sentence.

    Raises:
        InputError: for an OSError.
    """
    try:
        yield
    except OSError as error:
        if error.errno in _FULL:
            reason, remedy = "the disk is full", "free some space and do this again"
        else:
            reason = error.strerror or str(error)
        raise InputError(f"{path} cannot be written: {reason}; {remedy}") from error


def _cause(temporary: Path, error: RuntimeError) -> OSError:
    """Why a library could not write; it does not say, so the system is asked once more."""
    try:
        with temporary.open("ab") as file:
            file.write(bytes(_TRIAL_BYTES))
            file.flush()
            os.fsync(file.fileno())
    except OSError as refusal:
        return refusal
    return OSError(errno.EIO, " ".join(str(error).split()))
