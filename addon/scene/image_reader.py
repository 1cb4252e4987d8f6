# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads Blender's images into scene-linear pixels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

# Images read last, and what they were; a slide is asked for at every edit of its light.
_KEPT = 8
_read: dict[tuple[Any, ...], NDArray[np.float32]] = {}

# Colour spaces whose bytes are decoded exactly; what others hold is taken for sRGB, and said.
_LINEAR = {"Linear Rec.709", "Non-Color", "scene_linear"}
_ENCODED = {"sRGB"}


def find_image(name: str) -> Any:
    """The open file's `bpy.types.Image` of a name; None if there is none."""
    return bpy.data.images.get(name)


def read_image(image: Any, problems: list[str]) -> NDArray[np.float32] | None:
    """A `bpy.types.Image`'s pixels: (H, W, 4) float32, scene-linear, straight alpha, row 0 at the
    bottom. The same array again as long as the image is as it was.

    Args:
        image: the image.
        problems: takes a phrase for each thing about it that is not as in Blender.

    Returns:
        None where there are no pixels, which is then one of the problems.
    """
    image = image.original
    if image.source in ("MOVIE", "SEQUENCE", "TILED"):
        problems.append(f"of its image '{image.name}' only the frame or tile at hand is shown")
    size = tuple(image.size)
    if 0 in size:
        problems.append(f"its image '{image.name}' has no pixels; find the file or pack it")
        return None
    space = image.colorspace_settings.name
    if not image.is_float and space not in _LINEAR | _ENCODED:
        problems.append(
            f"its image '{image.name}' is taken for sRGB; its colour space '{space}' is not known"
        )
    key = _key(image)
    if key is None:
        return _pixels(image)
    known = _read.pop(key, None)
    if known is None:
        known = _pixels(image)
        while len(_read) >= _KEPT:
            _read.pop(next(iter(_read)))
    _read[key] = known
    return known


def _key(image: Any) -> tuple[Any, ...] | None:
    """What an image's pixels depend on; None while it is painted on."""
    if image.is_dirty and image.source != "GENERATED":
        return None
    stamp: object = None
    if image.packed_file is not None:
        stamp = image.packed_file.size
    elif image.source == "GENERATED":
        if image.is_dirty:
            return None
        stamp = (image.generated_type, tuple(image.generated_color))
    else:
        try:
            status = Path(bpy.path.abspath(image.filepath, library=image.library)).stat()
        except (OSError, ValueError):
            return None
        stamp = (status.st_mtime_ns, status.st_size)
    return (
        image.session_uid, image.filepath, image.source, stamp, tuple(image.size),
        image.colorspace_settings.name, image.alpha_mode, image.is_float,
    )  # fmt: skip


def _pixels(image: Any) -> NDArray[np.float32]:
    width, height = image.size
    flat = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(flat)
    values = flat.reshape(height, width, -1)
    rgba = np.ones((height, width, 4), dtype=np.float32)
    colors = min(values.shape[-1], 3)
    rgba[..., :3] = values[..., :colors] if colors == 3 else values[..., :1]
    if values.shape[-1] == 4 and image.alpha_mode != "NONE":
        rgba[..., 3] = values[..., 3]
    if not image.is_float:
        if image.colorspace_settings.name not in _LINEAR:
            rgba[..., :3] = _decoded(rgba[..., :3])
    elif image.alpha_mode != "CHANNEL_PACKED":
        # Blender keeps float pixels multiplied with their alpha.
        alpha = rgba[..., 3:]
        np.divide(rgba[..., :3], alpha, out=rgba[..., :3], where=alpha > 0.0)
    rgba[~np.isfinite(rgba)] = 0.0
    return rgba


def _decoded(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """IEC 61966-2-1: sRGB to linear."""
    low = values / np.float32(12.92)
    high = ((values + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    return np.asarray(np.where(values <= np.float32(0.04045), low, high), dtype=np.float32)
