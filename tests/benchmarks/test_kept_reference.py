# SPDX-License-Identifier: GPL-3.0-or-later
"""References in a folder: blocks of them are made finer, and stay so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from addon.progress import silent
from benchmarks.kept_reference import BLOCK, FINER, Block, KeptReference
from tools.reference import prepare

WIDTH, HEIGHT = 37, 21


@pytest.fixture
def scene() -> Any:
    """A soft shadow on a plane, which has noise; a picture that no whole number of blocks fills."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    bpy.ops.mesh.primitive_plane_add(size=10.0)
    bpy.ops.mesh.primitive_cube_add(size=0.5, location=(0.0, 0.0, 0.6))
    bpy.ops.object.light_add(type="AREA", location=(1.5, 0.0, 2.0))
    bpy.context.object.data.size = 1.0
    bpy.context.object.data.energy = 100.0
    bpy.ops.object.camera_add(location=(0.0, 0.0, 5.0))
    scene.camera = bpy.context.object
    prepare(scene)
    return scene


def test_blocks_are_rendered_finer_in_their_place(scene: Any, tmp_path: Path) -> None:
    kept = KeptReference(tmp_path, "key", 4)
    kept.require(scene, scene.camera, silent)
    kept.double(scene, scene.camera, silent)
    coarse = KeptReference(tmp_path, "key", 4)._held()
    # One in the picture, one at its upper right end.
    blocks = [Block(0, 16), Block(16, 32)]
    kept.refine(scene, scene.camera, blocks, silent)
    again = KeptReference(tmp_path, "key", 4)
    assert again.finer == blocks
    assert again.samples == 8
    fine = again._held()
    inside = np.zeros((HEIGHT, WIDTH), dtype=bool)
    for block in blocks:
        inside[block.row : block.row + BLOCK, block.column : block.column + BLOCK] = True
    for old, new in zip(coarse.base, fine.base, strict=True):
        assert np.array_equal(old[~inside], new[~inside])
        # The same picture: a block beside its place would show the shadow elsewhere.
        assert np.abs(old - new)[inside].mean() < 0.1 * old[inside].mean()
    noise = [part.noise_floor(inside)["psnr_luma"] or 0.0 for part in (coarse, fine)]
    # 12 dB for sixteen times the samples; of 256 pixels, within a few.
    assert noise[1] - noise[0] > 10.0 * np.log10(FINER) - 4.0
    assert not scene.render.use_border
    # Twice the samples of all of it are again of one kind.
    again.double(scene, scene.camera, silent)
    assert again.finer == []


def test_blocks_with_most_of_the_error_come_first(scene: Any, tmp_path: Path) -> None:
    kept = KeptReference(tmp_path, "key", 4)
    kept.require(scene, scene.camera, silent)
    image = kept._held().rgba[..., :3].astype(np.float64)
    image[18, 3] += 0.5
    image[2, 20] += 0.2
    # Half an 8-bit level everywhere is no block's in particular.
    assert kept.finer_blocks(image, 6) == [Block(16, 0), Block(0, 16)]
    assert kept.finer_blocks(image, 1) == [Block(16, 0)]
    kept.finer.append(Block(16, 0))
    assert kept.finer_blocks(image, 6) == [Block(0, 16)]
