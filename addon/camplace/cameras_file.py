# SPDX-License-Identifier: GPL-3.0-or-later
"""The cameras file: what `relume place` writes and `relume bake` may read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..whole_file import replacing
from .camera import CachingCamera

SCHEMA = "relume-cameras"
VERSION = 1


def to_json(cameras: tuple[CachingCamera, ...]) -> dict[str, Any]:
    """Plain values for JSON."""
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "cameras": [camera.to_json() for camera in cameras],
    }


def from_json(data: Any, name: str) -> tuple[CachingCamera, ...]:
    """The inverse of `to_json`. `name` says in errors where `data` came from.

    Raises:
        InputError: for anything that `to_json` did not write.
    """
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise InputError(f"{name} is not a cameras file; write one with relume place --out.")
    if data.get("version") != VERSION:
        raise InputError(
            f"{name} has version {data.get('version')!r} of the cameras file, not {VERSION}; "
            "write it again with relume place --out."
        )
    try:
        cameras = tuple(CachingCamera.from_json(camera) for camera in data["cameras"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"{name} is damaged ({error}); write it again with relume place --out."
        ) from error
    if not cameras or len({camera.id for camera in cameras}) != len(cameras):
        raise InputError(
            f"{name} has no cameras or two with one id; write it again with relume place --out."
        )
    return cameras


def write_cameras(path: Path, cameras: tuple[CachingCamera, ...]) -> None:
    """Write the file whole or not at all.

    Raises:
        InputError: if it cannot be written there.
    """
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8") as file:
        json.dump(to_json(cameras), file, indent=1)


def read_cameras(path: Path) -> tuple[CachingCamera, ...]:
    """Read the file.

    Raises:
        InputError: if it is missing or not a cameras file.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"The cameras file {path} cannot be read: {error.strerror}; write one with "
            "relume place --out."
        ) from error
    except ValueError as error:
        raise InputError(
            f"{path} is not a cameras file; write one with relume place --out."
        ) from error
    return from_json(data, str(path))
