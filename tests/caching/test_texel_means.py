# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours are means over texels, sharpened against being read bilinearly, within one surface."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from addon.caching import aov_render, bake_camera, bake_cameras
from addon.caching.occlusion_filter import smooth_occlusion
from addon.caching.presets import PRESETS
from addon.caching.specialize import AOV_PREFIX
from addon.caching.texel_means import sharpened, within_one_surface
from addon.scene.temporary_render import render_to

from .material_grid import (
    RESOLUTION,
    add_plane,
    bake,
    camera_above,
    empty_material,
    empty_scene,
    node_in,
)

# Where the camera stands over a plane that fills its picture.
HEIGHT, FOV = 2.0, 0.5 * np.pi
SIDE = 2.0 * HEIGHT * np.tan(0.5 * FOV)
# Of stripes, in texels: no texel of 64 sees quite what another does.
PERIOD = 2.71


def stripes(scene: Any) -> Any:
    """A plane whose colour is 1 or 0 by turns along X."""
    material, surface = empty_material("stripes")
    tree = material.node_tree
    place = node_in(tree, "ShaderNodeNewGeometry").outputs["Position"]
    x = node_in(tree, "ShaderNodeSeparateXYZ", Vector=place).outputs["X"]
    wrapped = tree.nodes.new("ShaderNodeMath")
    wrapped.operation = "WRAP"
    tree.links.new(x, wrapped.inputs[0])
    wrapped.inputs[1].default_value = PERIOD * SIDE / RESOLUTION
    wrapped.inputs[2].default_value = 0.0
    bright = tree.nodes.new("ShaderNodeMath")
    bright.operation = "LESS_THAN"
    tree.links.new(wrapped.outputs[0], bright.inputs[0])
    bright.inputs[1].default_value = 0.5 * PERIOD * SIDE / RESOLUTION
    node = node_in(tree, "ShaderNodeBsdfDiffuse", Color=bright.outputs[0])
    tree.links.new(node.outputs[0], surface)
    return add_plane(scene, "plane", (0.0, 0.0, 0.0), material, size=2.0 * SIDE)


def shares() -> NDArray[np.float64]:
    """(R,) of each column of texels that is bright."""

    def bright_until(x: NDArray[np.floating]) -> NDArray[np.floating]:
        whole = np.floor(x / PERIOD)
        return whole * 0.5 * PERIOD + np.minimum(x - whole * PERIOD, 0.5 * PERIOD)

    ends = np.arange(RESOLUTION + 1) - 0.5 * RESOLUTION
    return np.diff(bright_until(ends))


@pytest.mark.parametrize(("preset", "samples"), [("balanced", 4), ("final", 16)])
def test_texels_are_means_less_an_eighth_of_their_second_differences(
    tmp_path: Path, preset: str, samples: int
) -> None:
    scene = empty_scene()
    stripes(scene)
    store, _ = bake(scene, [camera_above((0, 0, 0), HEIGHT, FOV)], tmp_path, preset=preset)
    found = store.read_camera(0).channels["diffuse_color"][1:-1, 1:-1, 0].astype(np.float64)
    mean = shares()
    wanted = mean[1:-1] - 0.125 * (mean[2:] + mean[:-2] - 2.0 * mean[1:-1])
    # Along X the samples of a texel are one in each of as many strips, of which the stripes' two
    # edges at most go through two; what was negative is held at 0; sharpening takes 1.5 of a texel
    # and 0.125 of each of four neighbours.
    assert np.abs(found - np.maximum(wanted, 0.0)).max() < 2.0 * 2.0 / samples
    error = np.sqrt(np.mean((found - np.maximum(wanted, 0.0)) ** 2))
    assert error < 0.8 / samples


def test_drafts_keep_the_texels_centres(tmp_path: Path) -> None:
    scene = empty_scene()
    stripes(scene)
    store, _ = bake(scene, [camera_above((0, 0, 0), HEIGHT, FOV)], tmp_path, preset="draft")
    found = store.read_camera(0).channels["diffuse_color"]
    assert set(np.unique(found)) == {0.0, 1.0}


def test_means_are_rendered_without_what_is_not_averaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of ambient occlusion each of a texel's samples would cast all rays again."""
    rendered: list[tuple[int, set[str]]] = []

    def spy(path: Path, least_bytes: int, what: str, *, scene: str) -> None:
        layer = next(layer for layer in bpy.data.scenes[scene].view_layers if layer.use)
        names = {aov.name.removeprefix(AOV_PREFIX) for aov in layer.aovs}
        rendered.append((layer.samples, names))
        render_to(path, least_bytes, what, scene=scene)

    monkeypatch.setattr(aov_render, "render_to", spy)
    scene = empty_scene()
    scene.world = bpy.data.worlds.new("sky")
    stripes(scene)
    cameras = [camera_above((0, 0, 0), HEIGHT, FOV), camera_above((0.5, 0, 0), HEIGHT, FOV, 1)]
    store, _ = bake(scene, cameras, tmp_path, preset="final")
    everything = set(store.plan.stored) - {"depth"}
    assert {"ambient_occlusion", "normal", "diffuse_color"} <= everything
    # The second camera's first picture has all of them again.
    assert rendered == [(1, everything), (16, {"diffuse_color"})] * 2


@pytest.fixture
def rendered_occlusion(monkeypatch: pytest.MonkeyPatch) -> list[NDArray[np.float32]]:
    """Ambient occlusion as Cycles rendered it, before it is smoothed."""
    seen: list[NDArray[np.float32]] = []

    def spy(camera: Any, occlusion: Any, depth: Any, normal: Any, rays: int) -> Any:
        seen.append(occlusion)
        return smooth_occlusion(camera, occlusion, depth, normal, rays)

    monkeypatch.setattr(bake_camera, "smooth_occlusion", spy)
    return seen


def white_sky(scene: Any) -> None:
    world = scene.world = bpy.data.worlds.new("sky")
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)


def chequered_mask() -> Any:
    material, surface = empty_material("mask")
    tree = material.node_tree
    clear = node_in(tree, "ShaderNodeBsdfTransparent")
    white = node_in(tree, "ShaderNodeBsdfDiffuse")
    noise = node_in(tree, "ShaderNodeTexChecker", Scale=3.0)
    mixed = node_in(tree, "ShaderNodeMixShader", Fac=noise.outputs["Fac"])
    tree.links.new(clear.outputs[0], mixed.inputs[1])
    tree.links.new(white.outputs[0], mixed.inputs[2])
    tree.links.new(mixed.outputs[0], surface)
    return material


def test_each_ray_to_the_sky_counts(
    tmp_path: Path, rendered_occlusion: list[NDArray[np.float32]]
) -> None:
    """A change of `scene.cycles.samples` alone does not reach a render with persistent data."""
    scene = empty_scene()
    white_sky(scene)
    material = chequered_mask()
    add_plane(scene, "ground", (0.0, 0.0, 0.0), material, size=20.0)
    add_plane(scene, "roof", (0.0, 0.0, 3.0), material, size=4.0)
    bake(scene, [camera_above((0, 0, 0), HEIGHT, FOV)], tmp_path, preset="final")
    # Eight rays, of the 32 that *final* casts elsewhere, leave nine values; one leaves two.
    assert 4 < len(np.unique(np.round(rendered_occlusion[0], 4))) <= 9


def test_each_texel_has_rays_of_its_own(
    tmp_path: Path, rendered_occlusion: list[NDArray[np.float32]]
) -> None:
    """Else the filter of ambient occlusion would leave twice the noise."""
    scene = empty_scene()
    white_sky(scene)
    material = bpy.data.materials.new("plain")
    add_plane(scene, "ground", (0.0, 0.0, 0.0), material, size=200.0)
    wall = add_plane(scene, "wall", (-2.5, 0.0, 0.0), material, size=4.0)
    wall.rotation_euler.y = 0.5 * np.pi
    wall.scale.y = 1000.0
    bake(scene, [camera_above((0, 0, 0), HEIGHT, FOV)], tmp_path, preset="balanced")
    found = rendered_occlusion[0][..., 0].astype(np.float64)
    assert 0.5 < found.mean() < 0.95
    # The wall's shadow is the same along a column.
    noise = found - found.mean(axis=0)
    assert noise.std() > 0.05
    for a, b in ((noise[1:], noise[:-1]), (noise[:, 1:], noise[:, :-1])):
        # Of 4000 pairs by chance 0.016; of Cycles' blue noise 0.4.
        assert abs((a * b).mean()) < 0.1 * noise.var()


def test_occlusion_is_of_the_surface_that_a_texel_shows(
    tmp_path: Path,
    rendered_occlusion: list[NDArray[np.float32]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A table below a lid that no camera sees is dark, and the ground beside it open. No texel on
    the table's outline is between the two."""
    monkeypatch.setitem(PRESETS, "final", replace(PRESETS["final"], occlusion_rays=64))
    monkeypatch.setattr(bake_cameras, "_MOST_TO_SKY", 64)
    scene = empty_scene()
    white_sky(scene)
    add_plane(scene, "mask", (50.0, 0.0, 0.0), chequered_mask())
    material = bpy.data.materials.new("plain")
    add_plane(scene, "ground", (0.0, 0.0, 0.0), material, size=20.0)
    for name, height in (("table", 1.0), ("lid", 1.001)):
        plane = add_plane(scene, name, (0.0, 0.0, height), material)
        plane.rotation_euler.z = 0.3
    bpy.data.objects["lid"].visible_camera = False
    bake(scene, [camera_above((0, 0, 0), HEIGHT, FOV)], tmp_path, preset="final")
    found = rendered_occlusion[0][..., 0]
    assert 0.02 < (found < 0.1).mean() < 0.5
    assert (found > 0.7).mean() > 0.4
    # But where its outline passes within a two hundredth of a texel of the centre: 6 texels. Over
    # whole texels, 81 are.
    assert ((found >= 0.1) & (found <= 0.7)).sum() < 10


def test_reading_sharpened_means_is_nearer_to_the_pattern() -> None:
    """Rings of lines half a pixel to a pixel wide, two texels along a pixel's side."""
    random = np.random.default_rng(1)
    fine, side = 16, 40  # places along a texel's side, texels
    y, x = (np.mgrid[0 : fine * side, 0 : fine * side] + 0.5) / fine
    pattern = np.zeros(x.shape)
    for cx, cy, radius, width in zip(
        *random.uniform(0, side, (2, 60)), random.uniform(3, 12, 60), random.uniform(1, 2, 60),
        strict=True,
    ):  # fmt: skip
        pattern[np.abs(np.hypot(x - cx, y - cy) - radius) < 0.5 * width] = 1.0
    centres = pattern[fine // 2 :: fine, fine // 2 :: fine]
    means = pattern.reshape(side, fine, side, fine).mean(axis=(1, 3))
    both = sharpened(means[..., None].astype(np.float32), np.ones(means.shape, dtype=bool))[..., 0]

    def error(texels: NDArray[Any]) -> float:
        """Root mean square of what pixels, two texels wide, are off."""
        read = map_coordinates(texels, [y - 0.5, x - 0.5], order=1, mode="nearest")
        # A Gaussian of the variance of Blender's default pixel filter.
        off = gaussian_filter(read - pattern, 2 * 0.4155 * fine)
        inner = off[4 * fine : -4 * fine, 4 * fine : -4 * fine]
        return float(np.sqrt(np.mean(inner**2)))

    point, mean, sharp = error(centres), error(means), error(both)
    # 2 dB and 6 dB, as the module's text says.
    assert mean < 0.85 * point
    assert sharp < 0.55 * point


def test_edges_and_steps_are_not_averaged_over() -> None:
    camera = camera_above((0, 0, 0), HEIGHT, FOV)
    across = (np.arange(RESOLUTION) + 0.5) / RESOLUTION * 2.0 - 1.0
    slope = np.broadcast_to(1.0 / (1.0 + 0.4 * across), (RESOLUTION, RESOLUTION))
    inner = np.s_[1:-1, 1:-1]
    for scale in (1e-3, 1.0, 1e5):
        plane = (scale * slope).astype(np.float32)
        assert within_one_surface(camera, plane)[inner].all()
        # A step of a texel's width at that depth, over the picture's middle column.
        step = plane.copy()
        step[:, 32:] *= 1.0 + 2.0 / RESOLUTION
        found = within_one_surface(camera, step)
        assert not found[:, 31:33].any()
        assert found[2:-2, 2:30].all()
        # A roof's ridge of a right angle.
        ridge = (scale / (1.0 - np.abs(across) * 0.9)).astype(np.float32)
        found = within_one_surface(camera, np.broadcast_to(ridge, plane.shape))
        assert not found[:, 31:33].any()
        # Nothing beyond an outline.
        outline = plane.copy()
        outline[:, 40:] = 0.0
        assert not within_one_surface(camera, outline)[:, 39:].any()
