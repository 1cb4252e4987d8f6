# SPDX-License-Identifier: GPL-3.0-or-later
"""What the files of a cache are called: paths within its folder, as the manifest has them.

A picture's name ends with the first digits of its SHA-256, so that a camera that is baked again
does not touch its earlier picture. What comes before that is a *stem*.
"""

from __future__ import annotations

import re

from .file_record import FileRecord

WORLD_STEM = "world"
_DIGITS = 8
_PICTURE = re.compile(
    rf"(cameras/\d{{4,}}|frames/-?\d{{3,}}/\d{{4,}}|{WORLD_STEM})-[0-9a-f]{{{_DIGITS}}}\.exr"
)


def camera_stem(number: int, frame: int | None = None) -> str:
    """Of a camera's pictures of the cache's first frame, or of another one."""
    place = "cameras" if frame is None else f"frames/{frame:04d}"
    return f"{place}/{number:04d}"


def named(stem: str, record: FileRecord) -> str:
    """The name of the picture with this stem that `record` is of."""
    return f"{stem}-{record.sha256[:_DIGITS]}.exr"


def is_picture(name: str) -> bool:
    """Whether a path within the folder is one that a cache may give a picture of its own."""
    return _PICTURE.fullmatch(name) is not None
