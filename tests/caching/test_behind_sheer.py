# SPDX-License-Identifier: GPL-3.0-or-later
"""A caching camera that sees sheer surfaces has pictures of what lies behind them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from addon.caching import aov_render
from addon.caching.aov_render import Region
from addon.caching.bake import BakeSettings, bake_scene
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.presets import Preset
from addon.caching.store import CacheStore
from addon.caching.stored_framebuffers import StoredFramebuffers
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.temporary_render import render_to
from tests.relight.test_sheer_against_cycles import PANES, build, caching_cameras

RESOLUTION = 96


def baked(scene: Any, folder: Path, **settings: Any) -> CacheStore:
    geometry = with_render_depsgraph(scene, read_geometry)
    cameras = caching_cameras(scene, RESOLUTION)
    bake_scene(scene, geometry, cameras, folder, BakeSettings(preset="draft", **settings))
    return CacheStore.open(folder)


def ids(picture: DeepFramebuffer) -> Any:
    return np.rint(picture.channels["material_id"][..., 0]).astype(int)


@pytest.fixture
def three_panes() -> Any:
    return build(PANES["three tinted panes"][0])


def test_every_layer_is_in_some_picture(three_panes: Any, tmp_path: Path) -> None:
    store = baked(three_panes, tmp_path)
    names = store.plan.material_names
    pane = {1 + names.index(f"pane {number}") for number in range(3)}
    solid = {1 + names.index(name) for name in ("floor", "wall")}
    picture = store.read_camera(0)
    # Three panes overlap: what lies behind all of them comes last.
    assert len(picture.behind) == 3
    shown = [set(np.unique(ids(each))) for each in picture.pictures]
    assert pane | solid <= shown[0]
    assert not shown[-1] & pane
    before = picture.pictures[0].channels["depth"][..., 0]
    for earlier, later in zip(picture.pictures, picture.pictures[1:], strict=False):
        depth, through = later.channels["depth"][..., 0], np.isin(ids(earlier), [*pane])
        # Behind each pane there is something, farther away.
        assert (depth[through] > 1.0001 * earlier.channels["depth"][..., 0][through]).all()
        # Beside panes there is a margin for interpolation, which shows the same again.
        margin = (depth > 0.0) & ~through
        assert 0.0 < margin.mean() < 0.1
        same = margin & (earlier.channels["depth"][..., 0] > 0.0)
        assert depth[same] == pytest.approx(earlier.channels["depth"][..., 0][same])
        assert (before[depth > 0.0] > 0.0).all()
    assert store.manifest.seen[0].is_complete
    flat = StoredFramebuffers(store)
    assert len(flat) == sum(len(store.read_camera(n).pictures) for n in range(3))
    assert np.array_equal(flat[1].channels["depth"], picture.behind[0].channels["depth"])
    assert not flat[0].behind


@pytest.mark.parametrize("preset", ["draft", "final"])
def test_pictures_behind_are_rendered_where_something_is_sheer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, preset: Preset
) -> None:
    """And are what pictures rendered whole are, means and ambient occlusion too."""
    shares: dict[str, list[float]] = {}

    def spy(path: Path, least_bytes: int, what: str, *, scene: str) -> None:
        render = bpy.data.scenes[scene].render
        width, height = (
            (high - low if render.use_border else 1.0)
            for low, high in (
                (render.border_min_x, render.border_max_x),
                (render.border_min_y, render.border_max_y),
            )
        )
        shares.setdefault(what, []).append(width * height)
        render_to(path, least_bytes, what, scene=scene)

    scene = build(PANES["alpha 0.3"][0])
    scene.world = scene.world or bpy.data.worlds.new("sky")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    geometry = with_render_depsgraph(scene, read_geometry)
    cameras = [replace(c, resolution=256) for c in caching_cameras(scene, 256)][:2]
    stores = []
    for name in ("border", "whole"):
        monkeypatch.setattr(aov_render, "render_to", spy)
        if name == "whole":
            whole = Region((0, 256), (0, 256))
            monkeypatch.setattr(Region, "around", lambda *_, whole=whole: whole)
        bake_scene(scene, geometry, cameras, tmp_path / name, BakeSettings(preset=preset))
        stores.append(CacheStore.open(tmp_path / name).read_camera(0))
        if name == "border":
            # The first picture of each camera is whole, and the ones behind it are not.
            assert len(shares) == 2
            for of_camera in shares.values():
                assert of_camera[0] == 1.0
                assert 0.0 < min(of_camera) < 0.9
                assert max(of_camera[-2:]) < 0.9
    border, whole_store = stores
    assert len(border.behind) == len(whole_store.behind) > 0
    assert "ambient_occlusion" in border.channels
    for one, other in zip(border.pictures, whole_store.pictures, strict=True):
        for channel, values in one.channels.items():
            assert np.array_equal(values, other.channels[channel]), channel


def test_no_camera_has_more_where_nothing_is_sheer(tmp_path: Path) -> None:
    store = baked(build(PANES["leaf"][0]), tmp_path)
    assert [len(store.read_camera(n).pictures) for n in range(3)] == [1, 1, 1]
    assert len(StoredFramebuffers(store)) == 3


def test_a_change_behind_a_pane_is_seen(tmp_path: Path) -> None:
    """A ball that comes between pane and wall, where only the second picture looks."""
    scene = build(PANES["alpha 0.3"][0])
    baked(scene, tmp_path)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, location=(0.0, 0.4, 1.0))
    ball: Any = bpy.context.object
    ball.data.materials.append(bpy.data.materials["wall"])
    geometry = with_render_depsgraph(scene, read_geometry)
    cameras = caching_cameras(scene, RESOLUTION)
    report = bake_scene(
        scene, geometry, cameras, tmp_path, BakeSettings(preset="draft", resume=True)
    )
    assert 0 in report.again
    assert any("Sphere" in reason for reason in report.again[0])
    # One behind the camera is not.
    ball.location = (0.0, -50.0, 1.0)
    baked(scene, tmp_path, resume=True)
    ball.location = (0.0, -60.0, 1.0)
    geometry = with_render_depsgraph(scene, read_geometry)
    report = bake_scene(
        scene, geometry, cameras, tmp_path, BakeSettings(preset="draft", resume=True)
    )
    assert 0 not in report.again


def test_pictures_behind_survive_the_disk(three_panes: Any, tmp_path: Path) -> None:
    store = baked(three_panes, tmp_path)
    first = store.read_camera(0)
    again = replace(first, known_wide=first.wide)
    store.add_camera(again)
    read = CacheStore.open(tmp_path).read_camera(0)
    for one, other in zip(first.pictures, read.pictures, strict=True):
        assert one.channels.keys() == other.channels.keys()
        for name, values in one.channels.items():
            assert other.channels[name] == pytest.approx(values, abs=1e-4)
