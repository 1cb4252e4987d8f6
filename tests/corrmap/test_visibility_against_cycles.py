# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth of field and motion blur beside Cycles': the mean over visibility samples of what glows.

Surfaces glow in colours of their own, so that a picture is nothing but visibility.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

SIZE = 48
SAMPLES = 256
CYCLES_SAMPLES = 512

COLORS = {"Floor": (0.2, 0.2, 0.2), "Near": (0.9, 0.1, 0.1), "Far": (0.1, 0.8, 0.2)}


@pytest.fixture
def scene() -> Any:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    shapes: tuple[tuple[str, Any], ...] = (
        ("Floor", lambda: bpy.ops.mesh.primitive_plane_add(size=40.0)),
        ("Near", lambda: bpy.ops.mesh.primitive_cube_add(size=0.5, location=(-0.4, -3.2, 0.8))),
        ("Far", lambda: bpy.ops.mesh.primitive_uv_sphere_add(radius=0.8, location=(0.8, 1.5, 0.8))),
    )
    for name, add in shapes:
        add()
        obj: Any = bpy.context.object
        obj.name = name
        obj.data.materials.append(_glowing(name))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -5.0, 1.6), (1.35, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    render = scene.render
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_y = SIZE
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = CYCLES_SAMPLES, False
    scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type = "BOX"
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    return scene


def _glowing(name: str) -> Any:
    import bpy

    material: Any = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    emission.inputs["Color"].default_value = (*COLORS[name], 1.0)
    material.node_tree.links.new(emission.outputs[0], output.inputs[0])
    return material


def cycles_picture(scene: Any, folder: Path) -> NDArray[np.float64]:
    from addon.scene.temporary_render import render_to
    from tools.picture_file import read_picture

    path = folder / "cycles.exr"
    scene.render.filepath, scene.render.use_file_extension = str(path), False
    render_to(path, 1000, "the reference")
    return read_picture(path).rgb.astype(np.float64)


def sampled_picture(scene: Any) -> NDArray[np.float64]:
    import bpy

    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.visibility_samples import draw_visibility_sample, visibility_sample
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture
    from addon.scene.exposure_reader import read_exposure
    from addon.scene.geometry_reader import read_geometry
    from addon.scene.view_reader import read_view

    def read_at(frame: float, read: Any) -> Any:
        scene.frame_set(int(np.floor(frame)), subframe=float(frame % 1.0))
        return read(bpy.context.evaluated_depsgraph_get())

    view = read_at(scene.frame_current, lambda graph: read_view(graph, scene.camera))
    geometry = read_at(scene.frame_current, read_geometry)
    exposure = read_exposure(scene, scene.camera, view, geometry, read_at)
    assert exposure is None or not exposure.warnings
    scene.frame_set(scene.frame_current)
    color = np.array([(0.0, 0.0, 0.0), *(COLORS[name] for name in geometry.material_names)])
    surfaces = VisibleSurfacePass(GeometryBuffer(geometry, view.origin))
    total = np.zeros((SIZE, SIZE, 3))
    count = len(geometry.object_names)
    for k in range(SAMPLES):
        sample = visibility_sample(view, k, exposure, count)
        drawn = draw_visibility_sample(surfaces, view, sample)
        total += color[read_texture(drawn.position)[..., 3].astype(np.int64)]
    return total / SAMPLES


def compare(scene: Any, folder: Path) -> tuple[float, float]:
    """Root mean square difference; and from the same without blur."""
    expected = cycles_picture(scene, folder)
    found = sampled_picture(scene)
    scene.camera.data.dof.use_dof = scene.render.use_motion_blur = False
    sharp = sampled_picture(scene)

    def off(picture: NDArray[np.float64]) -> float:
        return float(np.sqrt(np.mean((picture - expected) ** 2)))

    return off(found), off(sharp)


# The mean of 512 random samples of values that are 0.4 about their mean, in the tenth of the pixels
# that are blurred, is off by 0.4 sqrt(0.1 / 512); 256 points of a sequence by no more. Measured:
# 0.0012 to 0.0023.
ENOUGH = 0.004


@pytest.mark.parametrize(("kind", "blades"), [("PERSP", 5), ("ORTHO", 0)])
def test_depth_of_field(
    gpu_context: None, scene: Any, tmp_path: Path, kind: str, blades: int
) -> None:
    data = scene.camera.data
    data.type, data.ortho_scale = kind, 4.0
    data.dof.use_dof = True
    data.dof.focus_object = scene.objects["Far"]
    # An opening of 0.4 m across.
    data.dof.aperture_fstop = (data.lens * 1e-3 if kind == "PERSP" else 1.0) / 0.4
    data.dof.aperture_blades, data.dof.aperture_rotation = blades, 0.3
    data.dof.aperture_ratio = 2.0 if blades else 1.0
    data.shift_x = 0.1
    found, sharp = compare(scene, tmp_path)
    assert found < ENOUGH
    assert sharp > 3.0 * ENOUGH


@pytest.mark.parametrize(
    ("what", "position"), [("object", "START"), ("camera", "CENTER"), ("lens", "END")]
)
def test_motion_blur(
    gpu_context: None, scene: Any, tmp_path: Path, position: str, what: str
) -> None:
    near, camera = scene.objects["Near"], scene.camera
    moved = near if what == "object" else camera
    for frame, share in ((1, -1.0), (3, 1.0)):
        if what == "lens":
            camera.data.lens = 50.0 + 20.0 * share
            camera.data.keyframe_insert("lens", frame=frame)
            continue
        turn = (0.0, 0.0, 0.8 * share) if what == "object" else (1.35, 0.0, 0.1 * share)
        moved.rotation_euler = turn
        moved.location.x += 0.4 * share
        moved.keyframe_insert("rotation_euler", frame=frame)
        moved.keyframe_insert("location", frame=frame)
    scene.frame_set(2)
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter, scene.render.motion_blur_position = 0.9, position
    found, sharp = compare(scene, tmp_path)
    assert found < ENOUGH
    assert sharp > 3.0 * ENOUGH


@pytest.mark.parametrize("gone", [(0.0, 0.0, 0.0), (1.0, 1.0, 0.0)])
def test_an_object_that_disappears(
    gpu_context: None, scene: Any, tmp_path: Path, gone: tuple[float, float, float]
) -> None:
    """Its scale jumps to 0, along all axes or one, while the shutter is open."""
    near = scene.objects["Near"]
    near.rotation_euler = (0.3, 0.2, 0.5)
    near.cycles.motion_steps = 3
    for frame, scale in ((1.0, (1.0, 1.0, 1.0)), (2.2, gone)):
        near.scale = scale
        near.keyframe_insert("scale", frame=frame)
    for curve in near.animation_data.action.layers[0].strips[0].channelbags[0].fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "CONSTANT"
    scene.frame_set(2)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.9
    scene.render.motion_blur_position = "CENTER"
    found, sharp = compare(scene, tmp_path)
    assert found < ENOUGH
    assert sharp > 3.0 * ENOUGH
