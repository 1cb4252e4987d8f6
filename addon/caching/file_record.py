# SPDX-License-Identifier: GPL-3.0-or-later
"""What a cache knows of its files, and whether they still are what was written."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError

BAKE_AGAIN = "bake the cache again"


@dataclass(frozen=True)
class FileRecord:
    """What the manifest knows of a finished file: its size in bytes and its SHA-256."""

    size: int
    sha256: str

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> FileRecord:
        """Raises KeyError, TypeError or ValueError on anything but an object of the two."""
        return cls(int(data["size"]), str(data["sha256"]))

    @classmethod
    def of(cls, path: Path) -> FileRecord:
        """A file's. Raises OSError."""
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        return cls(path.stat().st_size, digest)

    def is_of(self, path: Path) -> bool:
        """Whether the file is there and is what was written."""
        try:
            return FileRecord.of(path) == self
        except OSError:
            return False

    def require(self, path: Path) -> None:
        """Raises InputError when the file is missing, damaged or another one."""
        try:
            found = FileRecord.of(path)
        except (FileNotFoundError, NotADirectoryError) as error:
            raise InputError(f"{path} is missing; {BAKE_AGAIN}") from error
        except OSError as error:
            raise unreadable(path, error) from error
        if found != self:
            raise InputError(f"{path} is damaged or not the file that was baked; {BAKE_AGAIN}")


def unreadable(path: Path, error: OSError) -> InputError:
    """Why a file of a cache cannot be read."""
    return InputError(f"{path} cannot be read: {error.strerror or error}; {BAKE_AGAIN}")
