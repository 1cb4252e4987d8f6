# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures as a person sees them: through Blender's view transform, or in false colour."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.whole_file import replacing

from .picture_file import make_folder

# Turns of the colour circle between one caching camera and the next: the golden section keeps
# any few of them apart.
GOLDEN_TURN = 0.618033988749895
# A whole PNG ends with an IEND chunk: no data, and their checksum.
END_CHUNK = b"\x00\x00\x00\x00IEND\xae\x42\x60\x82"
# Squares along a caching camera's picture in the false colours, which show u and v.
SQUARES = 16


def write_display_png(scene: Any, rgba: NDArray[np.float32], path: Path) -> None:
    """Write a scene-linear picture as PNG through the scene's view transform, as F12 would.

    Args:
        scene: a `bpy.types.Scene`; its view, look, exposure and gamma apply.
        rgba: (H, W, 4) float32, premultiplied, row 0 at the bottom.
        path: the file; an existing one is replaced.

    Raises:
        InputError: the file cannot be written.
    """
    import bpy

    height, width = rgba.shape[:2]
    make_folder(path.parent)
    image = bpy.data.images.new("Relume", width, height, alpha=True, float_buffer=True)
    settings = scene.render.image_settings
    kept = {
        name: getattr(settings, name)
        for name in ("media_type", "file_format", "color_mode", "color_depth")
    }
    try:
        image.pixels.foreach_set(np.ascontiguousarray(rgba, dtype=np.float32).ravel())
        settings.media_type = "IMAGE"
        settings.file_format = "PNG"
        settings.color_mode = "RGBA" if scene.render.film_transparent else "RGB"
        settings.color_depth = "8"
        with replacing(path) as part:
            image.save_render(str(part.absolute()), scene=scene)
            _require_whole(part)
    finally:
        bpy.data.images.remove(image)
        for name, value in kept.items():
            setattr(settings, name, value)


def _require_whole(png: Path) -> None:
    """RuntimeError when a PNG was cut short, which Blender does not say."""
    if not png.read_bytes().endswith(END_CHUNK):
        raise RuntimeError("it was cut short")


def correspondence_colors(correspondence: NDArray[np.float32]) -> NDArray[np.float64]:
    """A correspondence map in false colour, as in the paper's figure 8.

    Args:
        correspondence: (H, W, 4): caching camera or -1, u, v, score.

    Returns:
        (H, W, 3) in [0, 1]: a hue for each camera, squares of its picture in lighter and
        darker, and white for holes.
    """
    camera = correspondence[..., 0].astype(np.float64)
    hue = (camera * GOLDEN_TURN % 1.0)[..., None]
    squares = np.floor(correspondence[..., 1:3].astype(np.float64) * SQUARES).sum(axis=-1) % 2.0
    # The hue circle as three shifted triangle waves (HSV at full saturation).
    wave = np.abs((hue + np.array([0.0, 2.0 / 3.0, 1.0 / 3.0])) % 1.0 * 6.0 - 3.0) - 1.0
    color = (0.25 + 0.75 * np.clip(wave, 0.0, 1.0)) * (0.72 + 0.28 * squares)[..., None]
    return np.where((camera < 0.0)[..., None], 1.0, color)
