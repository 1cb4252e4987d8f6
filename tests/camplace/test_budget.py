# SPDX-License-Identifier: GPL-3.0-or-later
"""Budgets are kept exactly, spent well, and what they leave out is told."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from addon.caching.channels import CHANNEL_BY_NAME
from addon.caching.framebuffer import DeepFramebuffer
from addon.camplace.budget import Budget
from addon.camplace.camera import CachingCamera
from addon.camplace.place import ENOUGH, place_cameras
from addon.camplace.placement import Placement
from addon.camplace.settings import PlacementSettings
from addon.errors import InputError
from addon.scene.geometry import SceneGeometry
from tests.synthetic import geometry_of, looking_at, perspective_view, room_with_box

SMALL = PlacementSettings(
    view_samples=600, area_samples=400, grid_cells=24, candidates=6, sphere_searches=10
)
VIEW = perspective_view(looking_at((1.6, -1.7, 0.9), (-0.4, 0.9, -0.6)), 320, 240, 1.2)


def _leaves(count: int) -> SceneGeometry:
    """Small triangles every which way in a ball of radius 1: foliage."""
    rng = np.random.default_rng(4)
    middle = rng.normal(size=(count, 1, 3))
    middle *= np.cbrt(rng.random((count, 1, 1))) / np.linalg.norm(middle, axis=-1, keepdims=True)
    corner = (middle + rng.normal(scale=0.06, size=(count, 3, 3))).reshape(-1, 3)
    return geometry_of([(corner, np.arange(3 * count).reshape(-1, 3))])


def _place(**budget: Any) -> Placement:
    return place_cameras(room_with_box(), (VIEW,), replace(SMALL, **budget))


@pytest.mark.parametrize("cameras", [1, 2, 5])
def test_a_number_of_cameras_is_kept_and_used(cameras: int) -> None:
    geometry = _leaves(1500)
    view = perspective_view(looking_at((3.0, 0.5, 0.5), (0.0, 0.0, 0.0)), 320, 240, 0.8)
    placement = place_cameras(geometry, (view,), replace(SMALL, cameras=cameras))
    # Foliage can never be covered whole, so all of the budget is used.
    assert len(placement.cameras) == cameras
    assert placement.stop == "budget"
    assert placement.left_out.over_budget > 0.0
    warned = any("larger budget" in warning for warning in placement.warnings)
    assert warned == (placement.shares.view_seen < ENOUGH)
    assert warned or cameras > 1


@settings(max_examples=6, deadline=None)
@given(tiles=st.integers(min_value=1, max_value=150))
def test_texels_are_never_exceeded(tiles: int) -> None:
    texels = tiles * 256**2 + 7
    placement = _place(texels=texels)
    assert 0 < placement.texels <= texels
    assert placement.texels == sum(camera.resolution**2 for camera in placement.cameras)


def test_many_texels_make_sharper_pictures_than_few() -> None:
    few, many = _place(texels=4 * 256**2), _place(texels=6 * 1024**2)
    assert many.well_seen[-1] > few.well_seen[-1] + 0.05
    assert many.seen[-1] >= few.seen[-1] - 0.01
    # What few texels can do best is to see everything coarsely.
    assert few.seen[-1] > 0.9


def test_megabytes_are_texels_of_a_stated_size() -> None:
    by_texels = _place(texels=1_000_000, bytes_per_texel=20.0)
    by_megabytes = _place(megabytes=20.0, bytes_per_texel=20.0)
    assert [c.to_json() for c in by_texels.cameras] == [c.to_json() for c in by_megabytes.cameras]


def test_a_texel_is_as_large_as_that_of_a_rich_scene() -> None:
    """What a material with textures in all that is common takes on the disk before compression."""
    rich = (
        "depth", "material_id", "normal", "diffuse_color", "layer_f0", "layer_f90", "specular_f0",
        "specular_f90", "roughness", "emission", "ambient_occlusion",
    )  # fmt: skip
    values = {
        name: np.zeros((2, 2, CHANNEL_BY_NAME[name].components), dtype=np.float32) for name in rich
    }
    camera = CachingCamera(0, np.eye(4), 1.0, 0.1, 10.0, 2, "CUBE_FACE", 0)
    raw = DeepFramebuffer(camera, values).raw_bytes / 4
    assert SMALL.bytes_per_texel == pytest.approx(raw, rel=0.2)


def test_the_tightest_of_several_budgets_holds() -> None:
    placement = _place(cameras=3, texels=9 * 256**2)
    assert len(placement.cameras) <= 3
    assert placement.texels <= 9 * 256**2
    assert Budget.of(replace(SMALL, texels=100_000, megabytes=1.0)).texels == 20_000


def test_a_larger_budget_never_sees_less() -> None:
    """Greedy by gain, and the same samples: each step only adds."""
    shares = [_place(cameras=cameras) for cameras in (1, 2, 3, 5, 8)]
    assert (np.diff([placement.seen[-1] for placement in shares]) >= -1e-12).all()
    assert (np.diff([placement.well_seen[-1] for placement in shares]) >= -1e-12).all()


def test_what_is_left_out_adds_up() -> None:
    placement = _place(cameras=1)
    reasons = placement.left_out
    missing = reasons.unreachable + reasons.over_budget + reasons.too_little
    assert missing == pytest.approx(1.0 - placement.seen[-1])
    shares = placement.shares
    assert 0.0 < shares.view_well <= shares.view_seen <= 1.0
    assert 0.0 < shares.area_well <= shares.area_seen <= 1.0
    view = placement.from_view
    weight = placement.sample_weight[view]
    assert shares.view_seen >= weight @ placement.covered[view] / weight.sum() - 1e-12
    report = placement.report()
    assert report["seen"]["by_view"] == shares.view_seen
    assert report["texels"] == placement.texels


@pytest.mark.parametrize(
    "budget",
    [
        {"cameras": 0},
        {"texels": 100},
        {"megabytes": 0.01},
        {"megabytes": float("nan")},
        {"megabytes": 5.0, "bytes_per_texel": 0.0},
    ],
)
def test_budgets_that_cannot_be_kept(budget: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        _place(**budget)


def test_earlier_cameras_do_not_break_a_budget_of_texels() -> None:
    coarse = replace(SMALL, max_resolution=256)
    before = place_cameras(room_with_box(), (VIEW,), coarse)
    assert before.texels > 8 * 256**2  # they ask for more than a coarse bake gives them
    counted = replace(coarse, texels=8 * 256**2)
    after = place_cameras(room_with_box(), (VIEW,), counted, earlier=before.cameras)
    assert after.kept > 0
    assert 0 < after.texels <= 8 * 256**2


def test_texels_still_sharpen_when_no_picture_more_is_allowed() -> None:
    coarse = place_cameras(
        room_with_box(), (VIEW,), replace(SMALL, cameras=1, texels=256**2, secondaries=0)
    )
    assert [camera.resolution for camera in coarse.cameras] == [256]
    wide = replace(VIEW, width=1280, height=960)  # whose pixels are smaller than those texels
    kept = place_cameras(
        room_with_box(), (wide,), replace(SMALL, cameras=1, texels=1024**2), earlier=coarse.cameras
    )
    assert len(kept.cameras) == 1
    assert kept.cameras[0].resolution > 256
