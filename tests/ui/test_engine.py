# SPDX-License-Identifier: GPL-3.0-or-later
"""F12 gives the session's picture, or says why there is none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from addon.caching.frame_state import FrameState
from addon.caching.store import CacheStore
from addon.errors import InputError
from addon.relight.session import RelightSession
from addon.relight.shadows.shadow_frustum import ShadowSettings
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.scene.light_reader import read_lights
from addon.scene.view_reader import find_camera, read_view
from addon.scene.world_reader import read_world, world_fingerprint
from addon.ui.cache_state import read_cache_state
from tests.ui.traced_cache import write_traced_cache
from tools.relit import read_exposure_of

WIDTH, HEIGHT, SAMPLES = 64, 40, 3


@pytest.fixture
def scene(extension: None, gpu_context: None, tmp_path: Path) -> Any:
    """The factory file's cube on a floor, under Relume; its cache folder is still empty."""
    scene: Any = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=30.0, location=(0.0, 0.0, -1.0))
    render = scene.render
    render.engine = "RELUME"
    render.resolution_x, render.resolution_y, render.resolution_percentage = WIDTH, HEIGHT, 100
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.filepath = str(tmp_path / "picture.exr")
    scene.relume.render_samples = SAMPLES
    scene.relume.fill_holes = False
    scene.relume.cache_folder = str(tmp_path / "cache.relume")
    return scene


def baked(scene: Any) -> Any:
    write_traced_cache(scene, Path(scene.relume.cache_folder), (3.0, -3.0, 3.0))
    return scene


def f12(scene: Any) -> NDArray[np.float32]:
    """(H, W, 4) as saved, row 0 at the bottom."""
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(scene.render.filepath) as exr:
        return np.array(exr.channels()["RGBA"].pixels, dtype=np.float32)[::-1]


def session_picture(scene: Any) -> NDArray[np.float32]:
    """The same without Blender's render pipeline, as the command line does it."""

    def read(graph: Any) -> Any:
        view = read_view(graph, find_camera(scene))
        return read_geometry(graph), read_lights(graph), read_world(graph), view

    geometry, lights, world, view = with_render_depsgraph(scene, read)
    store = CacheStore.open(Path(scene.relume.cache_folder))
    session = RelightSession(
        geometry, store, scene.relume.render_samples, ShadowSettings(method="auto")
    )
    session.set_lights(lights)
    session.set_world(world)
    session.set_view(view)
    session.set_exposure(read_exposure_of(scene, view, geometry))
    return session.render().combined


def test_f12_is_the_sessions_picture(scene: Any) -> None:
    baked(scene)
    picture = f12(scene)
    assert picture.shape == (HEIGHT, WIDTH, 4)
    expected = session_picture(scene)
    assert expected[..., :3].max() > 0.1
    # The same passes on the same driver; only their order in memory could differ.
    np.testing.assert_allclose(picture, expected, rtol=1e-5, atol=1e-6 * expected.max())


def test_f12_blurs_what_moves(scene: Any) -> None:
    """As the command line does, a camera that turns and a cube that goes aside."""
    cube, camera = bpy.data.objects["Cube"], scene.camera
    sharp = f12(baked(scene))
    for frame, side in ((1, -1.0), (3, 1.0)):
        cube.location = (0.6 * side, 0.0, 0.0)
        cube.keyframe_insert("location", frame=frame)
        camera.rotation_euler.z += 0.03 * side
        camera.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(2)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    picture = f12(scene)
    assert (scene.frame_current, scene.frame_subframe) == (2, 0.0)
    expected = session_picture(scene)
    assert (scene.frame_current, scene.frame_subframe) == (2, 0.0)
    np.testing.assert_allclose(picture, expected, rtol=1e-5, atol=1e-6 * expected.max())
    # At the frame itself nothing is elsewhere: only what moves differs.
    assert np.abs(picture - sharp).mean() > 3e-3


def test_f12_follows_a_light_edit(scene: Any) -> None:
    baked(scene)
    scene.world = None
    before = f12(scene)[..., :3]
    bpy.data.lights["Light"].energy *= 2.0
    after = f12(scene)[..., :3]
    # Light is linear in its power.
    np.testing.assert_allclose(after, 2.0 * before, rtol=1e-4, atol=1e-6 * float(before.max()))


def test_a_transparent_film_without_a_world(scene: Any) -> None:
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    baked(scene)
    scene.world = None
    assert f12(scene)[..., 3].min() == 1.0
    scene.render.film_transparent = True
    alpha = f12(scene)[..., 3]
    assert alpha.min() == 0.0
    assert alpha.max() == 1.0


def test_the_render_region_is_cut_out(scene: Any) -> None:
    baked(scene)
    whole = f12(scene)
    render = scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    # In double, 0.7 as float32 has it is a little less than 28 of 40 rows; not so in Blender.
    render.border_min_y, render.border_max_y = 0.3, 0.7
    inside = (slice(12, 28), slice(WIDTH // 4, 3 * WIDTH // 4))
    kept = f12(scene)
    # The rays are those of the whole picture, to float32's rounding, which turns over a visibility
    # sample here and there that meets an outline: of such a pixel one in 64, and in a cell that
    # holds more than one surface perhaps the place where that is shaded.
    apart = np.abs(kept[inside] - whole[inside]).max(axis=-1)
    assert np.mean(apart > 1e-5) < 0.1
    assert apart.max() < whole.max() / 64.0
    assert apart.mean() < 3e-5
    assert np.count_nonzero(kept) < kept.size // 2
    render.use_crop_to_border = True
    cropped = f12(scene)
    np.testing.assert_array_equal(cropped, kept[inside])
    assert cropped.shape == whole[inside].shape


@pytest.mark.parametrize("blur", ["lens", "motion"])
def test_the_render_region_of_a_view_that_is_blurred(scene: Any, blur: str) -> None:
    """It is blurred as the whole picture is there, to its border."""
    camera, render = scene.camera, scene.render
    for frame, side in ((1, -1.0), (3, 1.0)):
        camera.rotation_euler.z += 0.15 * side
        camera.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(2)
    render.use_motion_blur, render.motion_blur_shutter = blur == "motion", 1.0
    dof = camera.data.dof
    # Blur of some ten pixels.
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = blur == "lens", 3.0, 0.04
    baked(scene)
    whole = session_picture(scene)
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.3, 0.7
    apart = np.abs(f12(scene) - whole[12:28, 16:48]).max(axis=-1)
    # Measured: 3e-4 and 3e-5 of the brightest; with as narrow a border as without blur 0.03 and
    # 0.006 through the lens, 0.002 by motion; with the whole picture's lens in the region 0.28.
    # At an edge, one of a pixel's 64 visibility samples may see the surface beside it: the region's
    # projection rounds otherwise in float32.
    assert np.count_nonzero(apart > 1e-3 * whole.max()) <= 1
    assert apart.max() < whole.max() / 64.0
    assert np.mean(apart) < 1e-4 * whole.max()


def test_without_a_cache_it_says_so_and_shows_the_shapes(scene: Any) -> None:
    with pytest.raises(RuntimeError, match="no Relume cache"):
        bpy.ops.render.render()
    picture = render_result(scene)
    assert picture.std() > 0.01


def test_an_empty_scene_says_so(scene: Any) -> None:
    baked(scene)
    for obj in [obj for obj in scene.objects if obj.type == "MESH"]:
        bpy.data.objects.remove(obj)
    with pytest.raises(RuntimeError, match="Relume"):
        bpy.ops.render.render()


def test_a_panorama_says_so(scene: Any) -> None:
    baked(scene)
    scene.camera.data.type = "PANO"
    with pytest.raises(RuntimeError, match="pano"):
        bpy.ops.render.render()


def render_result(scene: Any) -> NDArray[np.float32]:
    """What the Image Editor would show."""
    path = scene.render.filepath
    bpy.data.images["Render Result"].save_render(path)
    with OpenEXR.File(path) as exr:
        return np.array(exr.channels()["RGBA"].pixels, dtype=np.float32)[..., :3]


def test_the_panel_tells_the_caches_state(scene: Any) -> None:
    assert read_cache_state(scene).summary == "Nothing is baked yet"
    baked(scene)
    state = read_cache_state(scene)
    assert state.summary.startswith("6 cameras baked (")
    assert state.approximations == ("material 'Glass': is shown as glossy",)
    manifest = Path(scene.relume.cache_folder) / "manifest.json"
    manifest.write_text("{", encoding="utf-8")
    state = read_cache_state(scene)
    assert state.icon == "ERROR"
    assert "damaged" in state.summary


def test_a_stale_cache_is_shown_with_a_word(scene: Any) -> None:
    baked(scene)
    f12(scene)
    current = read_cache_state(scene)
    assert current.icon == "CHECKMARK"
    assert "Current" in current.details[0]
    bpy.data.objects["Cube"].location.x += 0.5
    picture = f12(scene)
    assert picture[..., :3].max() > 0.1
    state = read_cache_state(scene)
    assert state.icon == "ERROR"
    assert "Stale" in state.details[0]


def test_a_world_that_changed_is_shown_as_baked_with_a_word(scene: Any) -> None:
    baked(scene)
    tree = scene.world.node_tree
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], background.inputs["Color"])
    store = CacheStore.open(Path(scene.relume.cache_folder))
    store.add_world(np.full((8, 16, 3), 0.25, dtype=np.float32), world_fingerprint(scene))
    before = f12(scene)
    assert read_cache_state(scene).icon == "CHECKMARK"
    background.inputs["Strength"].default_value *= 2.0
    np.testing.assert_array_equal(f12(scene), before)
    state = read_cache_state(scene)
    assert state.icon == "ERROR"
    assert "the world changed after the bake" in state.details[0]
    # Where no one looks, on the command line, it is refused.
    with pytest.raises(InputError, match="the world changed"):
        session_picture(scene)


def test_a_frame_is_shown_as_it_was_baked(scene: Any) -> None:
    """The cube moves; the second frame's pictures are others than the first one's."""
    cube = bpy.data.objects["Cube"]
    for frame, x in ((1, 0.0), (2, 1.0)):
        cube.location.x = x
        cube.keyframe_insert("location", frame=frame)
    scene.frame_set(2)
    alone = Path(scene.relume.cache_folder).with_name("alone.relume")
    second = write_traced_cache(scene, alone, (3.0, -3.0, 3.0))
    scene.frame_set(1)
    store = write_traced_cache(scene, Path(scene.relume.cache_folder), (3.0, -3.0, 3.0))
    store.set_frame(2, FrameState(second.manifest.fingerprint))
    for camera in second.cameras:
        store.add_frame_camera(2, second.read_camera(camera.id))

    first = f12(scene)
    assert "Current" in read_cache_state(scene).details[0]
    scene.frame_set(2)
    moved = f12(scene)
    assert "Current" in read_cache_state(scene).details[0]
    scene.relume.cache_folder = str(alone)
    np.testing.assert_array_equal(moved, f12(scene))
    assert not np.array_equal(moved, first)


def test_an_error_inside_ends_the_render_alone(scene: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is reported, and the next render is whole again."""
    baked(scene)
    whole = f12(scene)

    def broken(*_: Any) -> None:
        raise ValueError("something unforeseen")

    with monkeypatch.context() as patch:
        patch.setattr(RelightSession, "rendering", broken)
        with pytest.raises(RuntimeError, match="something unforeseen"):
            bpy.ops.render.render()
    assert np.array_equal(f12(scene), whole)
