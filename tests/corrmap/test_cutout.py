# SPDX-License-Identifier: GPL-3.0-or-later
"""Rasterized triangles are cut by their material's alpha mask."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from addon.scene.geometry import Cutout
from addon.scene.mask_value_reader import Extension
from tests import synthetic
from tests.reference.cutout import mask_alpha


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
def test_fragments_are_cut_as_the_twin_says(gpu_context: None, extension: str) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    corners = np.array([[-1.0, 0, -1], [1.0, 0, -1], [1.0, 0, 1], [-1.0, 0, 1]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    wall = corners * 3.0 + [0.0, 1.0, 0.0]
    geometry = synthetic.geometry_of([(corners, faces), (wall, faces)])
    # Texture coordinates from -0.7 to 1.9: all kinds of outside.
    uv = (corners[:, [0, 2]] + 1.0) * 1.3 - 0.7
    alpha = np.random.default_rng(11).random((5, 7)).astype(np.float32)
    kind = cast("Extension", extension)
    cut = replace(
        geometry,
        cutouts=(Cutout(0, alpha, kind),),
        uv=np.concatenate([uv[faces], np.zeros((2, 3, 2))]).astype(np.float32),
    )
    view = synthetic.perspective_view(synthetic.looking_at((0, -3, 0), (0, 0, 0)), 96, 96, 0.6)
    drawn = VisibleSurfacePass(GeometryBuffer(cut, view.origin)).draw(view)
    material = read_texture(drawn.position)[..., 3].ravel()
    # The view looks straight at the sheet: each pixel's place on it is a matter of proportion.
    centre = (np.arange(96) + 0.5) / 96 * 2.0 - 1.0
    x, z = (axis.ravel() * 3.0 * np.tan(0.3) for axis in np.meshgrid(centre, centre))
    on_sheet = np.maximum(np.abs(x), np.abs(z)) < 1.0
    value = mask_alpha(alpha, (np.stack([x, z], axis=1) + 1.0) * 1.3 - 0.7, extension)
    expected = np.where(on_sheet & (value >= 0.5), 1.0, 2.0)
    # Interpolated coordinates are rounded; only alphas within that of a half may flip.
    clear = np.abs(value - 0.5) > 1e-4
    assert clear.mean() > 0.99
    assert np.array_equal(material[clear], expected[clear])
    # Both outcomes occur (CLIP cuts all but the unit square, a quarter of the sheet).
    assert 0.05 < (expected == 1.0)[on_sheet].mean() < 0.8


def test_a_pass_without_cutouts_refuses_them(gpu_context: None) -> None:
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.raster_program import build_raster_program
    from addon.relight.shadows.shadow_pass import _PASS

    corners = np.array([[-1.0, 0, -1], [1.0, 0, -1], [1.0, 0, 1]])
    geometry = synthetic.geometry_of([(corners, np.array([[0, 1, 2]]))])
    cut = replace(
        geometry,
        cutouts=(Cutout(0, np.zeros((1, 1), dtype=np.float32), "REPEAT"),),
        uv=np.zeros((1, 3, 2), dtype=np.float32),
    )
    buffer = GeometryBuffer(cut, np.zeros(3))
    assert buffer.has_cutouts
    program = build_raster_program(_PASS, with_cutouts=False)
    with pytest.raises(ValueError, match="cut-outs"):
        buffer.draw(program, np.eye(4), "camera", uniforms={"eye": {"place": np.zeros(4)}})
