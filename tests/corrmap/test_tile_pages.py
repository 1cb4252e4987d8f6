# SPDX-License-Identifier: GPL-3.0-or-later
"""The GPU's copy of a cache: its texels, and each material's row of the table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.plan import ChannelPlan
from tests import synthetic

NAMES = ("one", "two", "three")


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
            "diffuse_color": random.random((*shape, 3)),
            "emission": random.uniform(0.0, 1e3, (*shape, 3)),
            "roughness": random.random((*shape, 1)),
        }
        channels = {name: np.where(hit, v, 0.0).astype(np.float32) for name, v in values.items()}
        result.append(DeepFramebuffer(replace(camera, resolution=resolution), channels))
    return result


@pytest.mark.parametrize("with_id", [True, False])
def test_every_material_has_its_column(gpu_context: None, with_id: bool) -> None:
    from addon.corrmap.tile_pages import upload_tiles
    from addon.glsl.shader import read_texture

    # Material 2 is seen by no camera; 9 is none of the plan's.
    frames = framebuffers((1, 3, 9))
    stored = ("depth", "material_id", "diffuse_color", "emission", "roughness")
    plan = ChannelPlan(
        tuple(name for name in stored if with_id or name != "material_id"),
        {} if with_id else {"material_id": (3.0,)},
        NAMES,
        material_constants={"layer_f0": ((0.25,), (0.5,), (0.75,))},
    )
    pages = upload_tiles(frames, plan)
    table = read_texture(pages.material_table)
    depth, number = (
        np.concatenate([f.channels[name].ravel() for f in frames])
        for name in ("depth", "material_id")
    )
    if not with_id:
        number = np.full_like(number, 3.0)
    masks = [(depth > 0.0) & (number == column) & (0 < column <= 3) for column in range(5)]
    layout = pages.surface_layout
    for place, (name, component) in enumerate(layout.values):
        values = np.concatenate([f.channels[name][..., component].ravel() for f in frames])
        overall = values[depth > 0.0].mean(dtype=np.float64)
        for column, own in enumerate(masks):
            expected = values[own].mean(dtype=np.float64) if own.any() else overall
            # One rounding to float32.
            found = table[place // 4, column, place % 4]
            assert found == pytest.approx(expected, rel=1e-6)
    constants = table[layout.constant_row, :, 0]
    usual = 0.25 * np.bincount(number[depth > 0.0].astype(int), minlength=10)[1:4].argmax() + 0.25
    assert constants == pytest.approx([usual, 0.25, 0.5, 0.75, usual])
    row, slot = pages.scale_rows["diffuse_color"]
    albedo = np.concatenate([f.channels["diffuse_color"].max(-1).ravel() for f in frames])
    for column, own in enumerate(masks[1:-1], start=1):
        assert table[row, column, slot] == (albedo[own].max() if own.any() else 0.0)
