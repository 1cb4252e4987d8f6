# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a slide, as Cycles is to see it."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.written_light import GROUP_MARK


def blender_picture(pixels: NDArray[np.float32], name: str) -> Any:
    """A `bpy.types.Image` of (H, W, 3) scene-linear pixels, packed into the file.

    Args:
        pixels: row 0 at the bottom.
        name: of the image that it was made from.
    """
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(
        f"Relume Slide: {name}", width, height, alpha=False, float_buffer=True, is_data=True
    )
    image[GROUP_MARK] = name
    rgba = np.ones((height, width, 4), dtype=np.float32)
    rgba[..., :3] = pixels
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    image.pack()
    return image
