# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the values of each pixel may be trusted: drawn only when it is asked for.

Nothing of it changes the picture. A pixel that reads texels has the product of three things that
are known of these:

- the share of the bilinear footprint that shows the pixel's own surface;
- texels to a pixel, where they are fewer than one, in the direction in which they are fewest;
- the root of the cosine at which the caching camera sees the surface.

One that was filled from neighbours has little, one with its material's mean has none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import PassShader, Texture, framebuffer, read_texture, texture_2d
from ..scene.view import View
from .camera_table import CAMERA_SAMPLERS, camera_table
from .correspondence import CorrespondenceMap
from .pixel_rays import RAY_BLOCK, pixel_rays
from .surface_buffer import SurfaceBuffer
from .tile_pages import TilePages

# A neighbour on the same surface is near; one beside it only has the same material.
TRUST_NEIGHBOURS = 0.2
TRUST_BESIDE = 0.1

HEAT_ALPHA = 0.8


@dataclass(frozen=True)
class Confidence:
    """Of the pixels' centres.

    Attributes:
        texture: RGBA32F: the confidence in [0, 1], -1 where nothing is seen; and, of what reads
            texels, the share, the texels to a pixel up to 1, and the cosine.
    """

    texture: Texture

    def read(self) -> NDArray[np.float32]:
        """(H, W, 4) float32, row 0 at the bottom."""
        return read_texture(self.texture)

    def soft(self) -> NDArray[np.bool_]:
        """(H, W) which pixels read texels that are wider than they are."""
        _, share, sharpness, _ = np.moveaxis(self.read(), -1, 0)
        return (share > 0.0) & (sharpness < 1.0)


class ConfidencePass:
    """Tells it of one sample of a view."""

    def __init__(self, pages: TilePages, origin: NDArray[np.float64]) -> None:
        self._pages = pages
        self._origin = origin
        self._cameras = camera_table(pages.cameras, pages.numbers, origin)
        self._program = PassShader(
            name="confidence",
            fragment="confidence",
            library=("tolerances", "caching_camera", "pixel_ray"),
            blocks=(RAY_BLOCK,),
            defines=(
                *pages.defines,
                ("TRUST_NEIGHBOURS", repr(TRUST_NEIGHBOURS)),
                ("TRUST_BESIDE", repr(TRUST_BESIDE)),
            ),
            samplers=(
                ("visible_position", "FLOAT_2D"),
                ("visible_normal", "FLOAT_2D"),
                ("correspondence", "FLOAT_2D"),
                *CAMERA_SAMPLERS,
                *pages.depth_samplers,
            ),
            outputs=(("VEC4", "confidence"),),
        ).build()

    def draw(
        self, view: View, surface: SurfaceBuffer, correspondence: CorrespondenceMap
    ) -> Confidence:
        """The confidence of a view's sample at the pixels' centres, as it was gathered."""
        texture = texture_2d(surface.width, surface.height)
        # Depths are taken along the rays: the bounds are of no matter.
        rays = pixel_rays(view, self._origin, np.stack([view.origin, view.origin]))
        self._program.draw_fullscreen(
            framebuffer([texture]),
            {
                "visible_position": surface.position,
                "visible_normal": surface.geometric_normal,
                "correspondence": correspondence.texture,
                "camera_table": self._cameras,
                **self._pages.depth_textures(),
            },
            {"ray": rays},
        )
        return Confidence(texture)


def draw_heat_map(confidence: Confidence) -> Texture:
    """RGBA16F, premultiplied scene-linear colours to lay over a picture, from red to blue."""
    texture = texture_2d(confidence.texture.width, confidence.texture.height, "RGBA16F")
    program = PassShader(
        name="heat_map",
        fragment="heat_map",
        defines=(("HEAT_ALPHA", repr(HEAT_ALPHA)),),
        samplers=(("confidence", "FLOAT_2D"),),
        outputs=(("VEC4", "heat"),),
    ).build()
    program.draw_fullscreen(framebuffer([texture]), {"confidence": confidence.texture}, {})
    return texture
