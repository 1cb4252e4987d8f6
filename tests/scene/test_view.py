# SPDX-License-Identifier: GPL-3.0-or-later
"""Projection: round trips, and Blender's own answer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector
from PIL import Image

from addon.camplace.camera import CachingCamera
from addon.errors import InputError
from addon.scene.lens import Lens
from addon.scene.view_reader import (
    find_camera,
    read_render_region,
    read_view,
    render_size,
    viewport_lens,
)
from tests.synthetic import looking_at, perspective_view


@pytest.fixture
def scene() -> bpy.types.Scene:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def add_camera(scene: bpy.types.Scene, name: str = "Camera") -> bpy.types.Object:
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    scene.collection.objects.link(camera)
    camera.location = (3.0, -4.0, 2.0)
    camera.rotation_euler = (1.1, 0.1, 0.6)
    return camera


@pytest.mark.parametrize(
    ("kind", "shift", "fit", "aspect"),
    [
        ("PERSP", 0.0, "AUTO", 1.0),
        ("PERSP", 0.3, "VERTICAL", 1.0),
        ("PERSP", -0.2, "HORIZONTAL", 1.7),
        ("ORTHO", 0.1, "AUTO", 1.0),
    ],
)
def test_views_project_as_blender(
    scene: bpy.types.Scene, kind: str, shift: float, fit: str, aspect: float
) -> None:
    camera = add_camera(scene)
    camera.data.type = kind
    camera.data.shift_x = shift
    camera.data.sensor_fit = fit
    camera.scale = (2.0, 2.0, 2.0)
    scene.render.resolution_x, scene.render.resolution_y = 320, 200
    scene.render.resolution_percentage = 50
    scene.render.pixel_aspect_x = aspect
    bpy.context.view_layer.update()
    view = read_view(bpy.context.evaluated_depsgraph_get(), camera)
    assert (view.width, view.height) == (160, 100)
    rng = np.random.default_rng(5)
    points = rng.normal(size=(50, 3))
    camera.scale = (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    expected = np.array([world_to_camera_view(scene, camera, Vector(p))[:2] for p in points])
    found = view.project(points)[:, :2] / [view.width, view.height]
    if aspect == 1.0:
        # Blender's own helper works in float32: some spacings of numbers near one.
        assert np.allclose(found, expected, atol=2e-5)
    origins, directions = view.rays(view.project(points)[:, :2])
    across = np.cross(points - origins, directions)
    assert np.abs(across).max() < 1e-9 * np.abs(points - origins).max()


def test_lenses_are_read_as_cycles_takes_them(scene: bpy.types.Scene) -> None:
    camera = add_camera(scene)
    camera.data.lens = 80.0
    dof = camera.data.dof

    def lens(kind: str) -> Lens | None:
        camera.data.type = kind
        bpy.context.view_layer.update()
        graph = bpy.context.evaluated_depsgraph_get()
        through, aside = (SimpleNamespace(view_perspective=k) for k in ("CAMERA", "PERSP"))
        space = SimpleNamespace(camera=camera)
        found = read_view(graph, camera).lens
        assert viewport_lens(graph, space, through) == found
        assert viewport_lens(graph, space, aside) is None
        return found

    assert lens("PERSP") is None
    dof.use_dof, dof.aperture_fstop, dof.focus_distance = True, 2.0, 3.0
    dof.aperture_blades, dof.aperture_rotation, dof.aperture_ratio = 7, 0.25, 1.5
    # Settings and matrices are float32.
    found = lens("PERSP")
    assert found is not None
    assert found.radius == pytest.approx(0.02)
    assert (found.focus_distance, found.blades, found.rotation, found.ratio) == (3.0, 7, 0.25, 1.5)
    focus = bpy.data.objects.new("Focus", None)
    scene.collection.objects.link(focus)
    bpy.context.view_layer.update()
    back = np.array(camera.matrix_world)[:3, 2]
    focus.location = np.array(camera.location) - 4.5 * back + np.cross(back, [0.0, 0.0, 1.0])
    dof.focus_object = focus
    camera.scale = (2.0, 3.0, 4.0)
    found = lens("ORTHO")
    assert found is not None
    assert found.radius == pytest.approx(0.25)
    assert found.focus_distance == pytest.approx(4.5, rel=1e-6)


def test_panoramas_are_refused(scene: bpy.types.Scene) -> None:
    camera = add_camera(scene, "Dome")
    camera.data.type = "PANO"
    bpy.context.view_layer.update()
    with pytest.raises(InputError, match="'Dome' is pano"):
        read_view(bpy.context.evaluated_depsgraph_get(), camera)


@pytest.mark.parametrize("scale", [(0.0, 0.0, 0.0), (1.0, 1.0, 0.0)])
@pytest.mark.parametrize("whose", ["camera", "parent"])
def test_cameras_without_a_size_are_refused(
    scene: bpy.types.Scene, scale: tuple[float, float, float], whose: str
) -> None:
    camera = add_camera(scene, "Flat")
    sized = camera
    if whose == "parent":
        camera.rotation_euler = (0.0, 0.0, 0.0)
        sized = camera.parent = bpy.data.objects.new("Rig", None)
        scene.collection.objects.link(sized)
    sized.scale = scale
    bpy.context.view_layer.update()
    with pytest.raises(InputError, match="camera 'Flat' has the scale 0"):
        read_view(bpy.context.evaluated_depsgraph_get(), camera)


def test_a_tiny_camera_is_read(scene: bpy.types.Scene) -> None:
    camera = add_camera(scene)
    camera.scale = (1e-6, 1e-6, 1e-6)
    bpy.context.view_layer.update()
    view = read_view(bpy.context.evaluated_depsgraph_get(), camera)
    rotation = view.world_from_camera[:3, :3]
    assert np.allclose(rotation, np.array(camera.rotation_euler.to_matrix()), atol=1e-5)


def test_cameras_are_found_by_name(scene: bpy.types.Scene) -> None:
    with pytest.raises(InputError, match="no camera; add one"):
        find_camera(scene)
    first = add_camera(scene, "First")
    assert find_camera(scene) == first
    second = add_camera(scene, "Second")
    scene.camera = second
    assert find_camera(scene) == second
    assert find_camera(scene, "First") == first
    with pytest.raises(InputError, match="no camera 'Third'; it has: First, Second"):
        find_camera(scene, "Third")


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_caching_cameras_round_trip(offset: float) -> None:
    camera = CachingCamera(
        id=3,
        world_from_camera=looking_at((offset + 1.0, offset, 2.0), (offset, offset + 3.0, 0.0)),
        fov=1.7,
        near=0.1,
        far=50.0,
        resolution=512,
        kind="PERSPECTIVE",
        source=2,
    )
    rng = np.random.default_rng(7)
    uv_depth = np.concatenate([rng.random((100, 2)), rng.uniform(0.1, 50.0, (100, 1))], axis=1)
    back = camera.project(camera.unproject(uv_depth))
    # World coordinates of a million metres have a spacing of 1e-10 m; the nearest depth is 0.1.
    assert np.abs(back - uv_depth).max() < 1e-6 if offset else 1e-12
    again = CachingCamera.from_json(camera.to_json())
    assert np.array_equal(again.world_from_camera, camera.world_from_camera)
    assert again.fov == camera.fov


def test_broken_camera_files_are_refused() -> None:
    good = CachingCamera(0, np.eye(4), 1.0, 0.1, 10.0, 64, "CUBE_FACE", 0).to_json()
    with pytest.raises(ValueError, match="kind"):
        CachingCamera.from_json({**good, "kind": "FISHEYE"})
    with pytest.raises(ValueError, match="4x4"):
        CachingCamera.from_json({**good, "world_from_camera": [[1.0]]})


def test_rays_pass_through_what_they_project() -> None:
    view = perspective_view(looking_at((1, 2, 3), (0, 0, 0)), 64, 48, 1.0)
    origins, directions = view.rays(np.array([[0.0, 0.0], [64.0, 48.0], [32.0, 24.0]]))
    back = view.project(origins + 5.0 * directions)
    assert np.allclose(back[:, :2], [[0, 0], [64, 48], [32, 24]], atol=1e-9)


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("ratio", [1e3, 1e6, 1e8, 1e10, 1e12])
def test_rays_do_not_need_the_far_plane(scene: bpy.types.Scene, kind: str, ratio: float) -> None:
    camera = add_camera(scene)
    camera.data.type = kind
    camera.data.shift_x, camera.data.shift_y = 0.3, -0.2
    camera.data.clip_start, camera.data.clip_end = 0.1, 0.1 * ratio
    scene.render.resolution_x, scene.render.resolution_y = 320, 200
    bpy.context.view_layer.update()
    view = read_view(bpy.context.evaluated_depsgraph_get(), camera)
    rng = np.random.default_rng(11)
    in_camera = np.stack([*rng.normal(size=(2, 50)), -rng.uniform(1.0, 20.0, 50)], axis=-1)
    points = in_camera @ view.world_from_camera[:3, :3].T + view.origin
    xy = view.project(points)[:, :2]
    with np.errstate(all="raise"):
        origins, directions = view.rays(xy)
    assert np.allclose(np.linalg.norm(directions, axis=-1), 1.0, atol=1e-12)
    # Rays begin before what is seen, and pass through it to float64's rounding over 20 m.
    assert (((points - origins) * directions).sum(axis=-1) > 0.0).all()
    assert np.abs(np.cross(points - origins, directions)).max() < 1e-9
    if kind == "PERSP":
        assert (origins == view.origin).all()
    else:
        # A near plane at 0.1 m is lost in the rounding of a matrix that reaches far, but not by
        # more than itself.
        depth = (origins - view.origin) @ -view.world_from_camera[:3, 2]
        assert depth.min() > -1e-9
        assert depth.max() < 0.25


class _Sizes(bpy.types.RenderEngine):
    """Renders nothing; the result has the size that Blender gives it."""

    bl_idname = "RELUME_TEST_SIZES"
    bl_label = "Sizes"

    def render(self, depsgraph: Any) -> None:
        self.end_result(self.begin_result(0, 0, 1, 1))


@pytest.fixture
def sizes(scene: bpy.types.Scene, tmp_path: Path) -> Iterator[Callable[[], tuple[int, int]]]:
    """Gives the width and height of a render; RuntimeError where Blender makes none."""
    bpy.utils.register_class(_Sizes)
    render = scene.render
    render.engine = _Sizes.bl_idname
    render.image_settings.file_format = "PNG"
    render.filepath = str(tmp_path / "size.png")

    def size() -> tuple[int, int]:
        bpy.ops.render.render(write_still=True)
        with Image.open(render.filepath) as picture:
            return picture.size

    yield size
    bpy.utils.unregister_class(_Sizes)


def test_render_regions_are_blenders(
    scene: bpy.types.Scene, sizes: Callable[[], tuple[int, int]]
) -> None:
    """To the pixel, whatever share of a picture whose size is a share itself they are."""
    add_camera(scene)
    scene.camera = scene.objects["Camera"]
    render = scene.render
    rng = np.random.default_rng(3)
    refused = 0
    for _ in range(60):
        render.use_border = render.use_crop_to_border = False
        render.resolution_x, render.resolution_y = (int(n) for n in rng.integers(20, 200, 2))
        # In floating point, 29 percent of 100 pixels are 28.999.
        render.resolution_percentage = int(rng.choice([100, 29, 57, 58]))
        width, height = render_size(scene)
        parts = int(rng.integers(3, 20))
        x, y = np.sort(rng.integers(0, parts + 1, (2, 2)), axis=1) / parts
        render.border_min_x, render.border_max_x = x
        render.border_min_y, render.border_max_y = y
        render.use_border = render.use_crop_to_border = True
        view = perspective_view(np.eye(4), width, height, 1.0)
        try:
            region = read_render_region(render, view)
        except InputError:
            refused += 1
            with pytest.raises(RuntimeError, match="too small"):
                sizes()
            continue
        assert region is not None
        assert sizes() == (region.right - region.left, region.top - region.bottom)
    assert 0 < refused < 30


def test_a_renders_size_is_blenders(
    scene: bpy.types.Scene, sizes: Callable[[], tuple[int, int]]
) -> None:
    add_camera(scene)
    scene.camera = scene.objects["Camera"]
    scene.render.resolution_x, scene.render.resolution_y = 100, 50
    for percentage in (29, 57, 58, 100):
        scene.render.resolution_percentage = percentage
        assert render_size(scene) == sizes()
