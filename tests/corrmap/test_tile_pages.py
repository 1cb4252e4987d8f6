# SPDX-License-Identifier: GPL-3.0-or-later
"""The GPU's copy of a cache: each material's mean, for surfaces that no camera saw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.packing import make_packing
from tests import synthetic

MATERIALS = 3


def framebuffers(seen: tuple[int, ...], resolution: int = 8) -> list[DeepFramebuffer]:
    """Random texels of the materials `seen` (0 for one that the plan does not know)."""
    random = np.random.default_rng(1)
    result = []
    for camera in synthetic.cube_cameras((0, 0, 0), resolution)[:2]:
        shape = (resolution, resolution)
        hit = random.random((*shape, 1)) < 0.7
        values = {
            "depth": random.uniform(1.0, 2.0, (*shape, 1)),
            "material_id": random.choice(seen, (*shape, 1)),
            "emission": random.uniform(0.0, 1e3, (*shape, 3)),
            "roughness": random.random((*shape, 1)),
        }
        channels = {name: np.where(hit, v, 0.0).astype(np.float32) for name, v in values.items()}
        result.append(DeepFramebuffer(replace(camera, resolution=resolution), channels))
    return result


@pytest.mark.parametrize("with_id", [True, False])
def test_every_material_has_the_mean_of_its_texels(gpu_context: None, with_id: bool) -> None:
    from addon.corrmap.tile_pages import upload_tiles
    from addon.glsl.shader import read_texture

    # Material 2 is seen by no camera; 9 is none of the plan's.
    frames = framebuffers((1, 3, 9))
    stored = ("depth", "material_id", "emission", "roughness")
    constants = {} if with_id else {"material_id": (3.0,)}
    packing = make_packing([n for n in stored if with_id or n != "material_id"], constants)
    means = read_texture(upload_tiles(frames, packing, MATERIALS).means)
    depth, number = (
        np.concatenate([f.channels[name].ravel() for f in frames])
        for name in ("depth", "material_id")
    )
    if not with_id:
        number = np.full_like(number, 3.0)
    for row, texture in enumerate(packing.textures):
        for slot, (name, component) in enumerate(texture.components):
            values = np.concatenate([f.channels[name][..., component].ravel() for f in frames])
            overall = values[depth > 0.0].mean(dtype=np.float64)
            for column in range(MATERIALS + 2):
                own = (depth > 0.0) & (number == column) & (0 < column <= MATERIALS)
                expected = values[own].mean(dtype=np.float64) if own.any() else overall
                # One rounding to float32.
                assert means[row, column, slot] == pytest.approx(expected, rel=1e-6)
