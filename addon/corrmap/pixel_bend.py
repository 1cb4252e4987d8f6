# SPDX-License-Identifier: GPL-3.0-or-later
"""What passes are given that find how normals turn within a pixel (see `normal_bend`)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import source
from ..glsl.uniforms import Field, UniformBlock

# The standard deviation of a part, in widths of a square of its area: of the square itself it is
# 0.29. Places are not spread as evenly as such squares, and neighbouring parts had better overlap.
DEVIATION = 0.7

LOOK_BLOCK = UniformBlock("look", (Field("vec4", "eye"), Field("float", "deviation")))

# What `pixel_bend` needs, before and after lib/seen_corners.glsl.
BEND_LIBRARY = ("frame_across", "ellipse")
BEND_GLSL = source("lib/corner_bend.glsl") + source("lib/pixel_bend.glsl")


def look_uniforms(eye: NDArray[np.float64], pixel: float, samples: int = 1) -> dict[str, Any]:
    """The values of LOOK_BLOCK: `VisibleSurface.eye` and `.pixel`, shared by so many samples."""
    return {"eye": eye, "deviation": DEVIATION * pixel / samples**0.5}
