# SPDX-License-Identifier: GPL-3.0-or-later
"""What a cache knows of its files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class FileRecord:
    """What the manifest knows of a finished file: its size in bytes and its SHA-256."""

    size: int
    sha256: str

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> FileRecord:
        """Raises KeyError, TypeError or ValueError on anything but an object of the two."""
        return cls(int(data["size"]), str(data["sha256"]))
