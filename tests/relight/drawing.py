# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing into a layer and reading it back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.glsl.shader import framebuffer, read_texture, texture_2d
from addon.relight.light_points.light_sample import LightSample
from addon.relight.lights.light_objects import ObjectShares
from addon.relight.lights.light_pass import LightPass
from addon.relight.shading.albedo_pass import AlbedoTextures
from addon.relight.shading.shadow import Shadow
from addon.scene.light import Light
from tests.reference.surfaces import Surfaces

TABLES = AlbedoTextures()


def drawn(width: int, height: int, draw: Callable[[Any], None]) -> NDArray[np.float64]:
    """(H, W, 4): what `draw` adds to an empty layer."""
    layer = texture_2d(width, height)
    target = framebuffer([layer])
    with target.bind():
        target.clear(color=(0.0, 0.0, 0.0, 0.0))
    draw(target)
    return read_texture(layer).astype(np.float64)


def drawn_light(
    surface: Surfaces,
    light: Light,
    samples: Sequence[LightSample],
    *,
    shadow: Shadow | None = None,
    shares: ObjectShares | None = None,
) -> NDArray[np.float64]:
    """(H, W, 4): the mean of some points of a light."""
    textures = surface.upload()
    light_pass = LightPass(TABLES, surface.layout)

    def draw(target: Any) -> None:
        for sample in samples:
            light_pass.draw(
                textures,
                light,
                sample,
                target,
                shadow=shadow,
                weight=1.0 / len(samples),
                objects=None if shares is None else shares.texture,
            )

    height, width, _ = surface.position.shape
    return drawn(width, height, draw)
