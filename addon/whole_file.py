# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are on the disk whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError

# A quota that is used up is a full disk to whoever writes.
_FULL = frozenset({errno.ENOSPC, errno.EDQUOT})

# More than what a nearly full disk may still have room for in a file's last block.
_TRIAL_BYTES = 1 << 20


@contextmanager
def replacing(path: Path, remedy: str = "choose another place") -> Iterator[Path]:
    """A temporary path; the file written there takes the place of `path` when the block ends.

    The file reaches the disk before it is renamed, so that a reader finds the old file or the
    new one, whatever happens in between. When the block raises, nothing is left of it. The
    temporary name holds this process's number.

    Args:
        path: the file; an existing one is replaced, and where it is a link, what that leads to.
        remedy: what to do if it cannot be written, for the error.

    Raises:
        InputError: the file cannot be written, by an OSError, or by a RuntimeError, which is
            what libraries that write files raise; or there is something other than a file.
    """
    place = place_of(path, remedy)
    temporary = place.with_name(f".{place.name}.{os.getpid()}.part")
    with write_errors(path, remedy):
        try:
            yield temporary
            with temporary.open("rb+") as file:
                os.fsync(file.fileno())
            temporary.replace(place)
        except RuntimeError as error:
            raise _cause(temporary, error) from error
        finally:
            temporary.unlink(missing_ok=True)


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
