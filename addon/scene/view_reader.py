# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads cameras and viewports into `View`s."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from ..errors import InputError
from .caching_collection_reader import shot_cameras
from .lens import Lens
from .render_region import RenderRegion
from .view import FilterKind, PixelFilter, View


def find_camera(scene: Any, name: str | None = None) -> Any:
    """The scene's camera object by name, or its active one; never a caching camera.

    Raises:
        InputError: no such camera; the message lists those there are.
    """
    cameras = {obj.name: obj for obj in shot_cameras(scene)}
    if not cameras:
        raise InputError(f"scene '{scene.name}' has no camera; add one")
    if name is None:
        active = scene.camera
        return active if active in cameras.values() else next(iter(cameras.values()))
    if name not in cameras:
        raise InputError(
            f"scene '{scene.name}' has no camera '{name}'; it has: {', '.join(sorted(cameras))}"
        )
    return cameras[name]


def render_size(scene: Any) -> tuple[int, int]:
    """Width and height of the scene's renders, pixels; whole numbers all the way, as in Blender."""
    render = scene.render
    percentage = render.resolution_percentage
    width, height = (n * percentage // 100 for n in (render.resolution_x, render.resolution_y))
    return max(1, width), max(1, height)


def read_view(
    depsgraph: Any, camera: Any, width: int | None = None, height: int | None = None
) -> View:
    """The view of a camera object, at the scene's render size unless another is given.

    Raises:
        InputError: the camera is panoramic or of a custom kind, or has the scale 0.
    """
    scene = depsgraph.scene_eval
    evaluated = camera.evaluated_get(depsgraph)
    if evaluated.data.type not in ("PERSP", "ORTHO"):
        raise InputError(
            f"camera '{camera.name}' is {evaluated.data.type.lower()}; "
            "Relume shows perspective and orthographic cameras"
        )
    width, height = width or render_size(scene)[0], height or render_size(scene)[1]
    clip_from_camera = evaluated.calc_matrix_camera(
        depsgraph,
        x=width,
        y=height,
        scale_x=scene.render.pixel_aspect_x,
        scale_y=scene.render.pixel_aspect_y,
    )
    data = evaluated.data
    return View(
        world_from_camera=rigid(evaluated.matrix_world, f"camera '{camera.name}'"),
        clip_from_camera=_with_clips(np.array(clip_from_camera), data.clip_start, data.clip_end),
        width=width,
        height=height,
        perspective=evaluated.data.type == "PERSP",
        pixel_filter=read_pixel_filter(scene),
        name=camera.name,
        lens=_read_lens(depsgraph, evaluated),
    )


def read_render_region(render: Any, view: View) -> RenderRegion | None:
    """The part of a view that Blender's render settings ask for; None for all.

    Raises:
        InputError: the region has no pixel.
    """
    if not render.use_border:
        return None

    # As Blender has it, in float32 and rounded down: 0.7 of 10 pixels are 7 there, and 6 in double.
    def edge(share: float, pixels: int) -> int:
        return int(np.float32(share) * np.float32(pixels))

    width, height = view.width, view.height
    left, right = edge(render.border_min_x, width), edge(render.border_max_x, width)
    bottom, top = edge(render.border_min_y, height), edge(render.border_max_y, height)
    if right <= left or top <= bottom:
        raise InputError(
            "the render region has no pixel; draw a larger one, or clear it (Ctrl+Alt+B)"
        )
    return RenderRegion(
        width,
        height,
        left,
        bottom,
        right,
        top,
        is_cropped=bool(render.use_crop_to_border),
        is_blurred=view.lens is not None or bool(render.use_motion_blur),
    )


def read_viewport(region: Any, region_data: Any, scene: Any, lens: Lens | None = None) -> View:
    """What a 3D viewport shows: its own navigation, or the camera it looks through, and the lens of
    that."""
    return View(
        world_from_camera=rigid(region_data.view_matrix.inverted(), "the viewport"),
        clip_from_camera=np.array(region_data.window_matrix, dtype=np.float64),
        width=region.width,
        height=region.height,
        perspective=bool(region_data.is_perspective),
        pixel_filter=read_pixel_filter(scene),
        lens=lens,
    )


def viewport_lens(depsgraph: Any, space: Any, region_data: Any) -> Lens | None:
    """The lens of the camera that a 3D viewport looks through; None for its own navigation."""
    camera = getattr(space, "camera", None)
    if region_data.view_perspective != "CAMERA" or camera is None or camera.type != "CAMERA":
        return None
    if camera.data.type not in ("PERSP", "ORTHO"):
        return None
    return _read_lens(depsgraph, camera.evaluated_get(depsgraph))


def _read_lens(depsgraph: Any, camera: Any) -> Lens | None:
    """The opening of an evaluated camera's lens, as Cycles takes it; None for a pinhole."""
    data = camera.data
    if not data.dof.use_dof:
        return None
    # The opening is the focal length (a parallel projection: a metre) over the f-stop, across.
    length = data.lens * 1e-3 if data.type == "PERSP" else 1.0
    distance = float(data.dof.focus_distance)
    focus = data.dof.focus_object
    if focus is not None:
        matrix = focus.evaluated_get(depsgraph).matrix_world
        bone = data.dof.focus_subtarget
        if bone and focus.pose is not None and bone in focus.pose.bones:
            matrix = matrix @ focus.evaluated_get(depsgraph).pose.bones[bone].matrix
        away = np.array(matrix)[:3, 3] - np.array(camera.matrix_world)[:3, 3]
        axis = np.array(camera.matrix_world)[:3, 2]
        distance = float(np.abs(away @ axis) / np.linalg.norm(axis))
    if distance <= 0.0:
        return None
    return Lens(
        radius=length / (2.0 * max(data.dof.aperture_fstop, 1e-5)),
        focus_distance=distance,
        blades=data.dof.aperture_blades,
        rotation=data.dof.aperture_rotation,
        ratio=max(data.dof.aperture_ratio, 1e-5),
    )


def _with_clips(clip_from_camera: Any, near: float, far: float) -> Any:
    """(4, 4) float64, the same with the clip distances to float64's precision: in Blender's
    float32 a far plane 1e7 times as far as the near one is lost."""
    matrix = np.asarray(clip_from_camera, dtype=np.float64)
    near, far = float(near), max(float(far), float(np.nextafter(near, np.inf)))
    if matrix[3, 2]:
        matrix[2, 2:] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    else:
        matrix[2, 2:] = -2.0 / (far - near), -(far + near) / (far - near)
    return matrix


def read_pixel_filter(scene: Any) -> PixelFilter:
    """Cycles' pixel filter as set in the scene; Cycles' own defaults without Cycles."""
    cycles = getattr(scene, "cycles", None)
    if cycles is None:
        return PixelFilter()
    kind = cast("FilterKind", cycles.pixel_filter_type)
    # Cycles' box filter is always one pixel wide.
    return PixelFilter(kind, 1.0 if kind == "BOX" else float(cycles.filter_width))


def rigid(matrix: Any, owner: str) -> Any:
    """(4, 4) float64 with orthonormal axes: cameras ignore their object's scale, as in Cycles.

    Blender's matrices are float32; the nearest rotation (polar decomposition) takes their
    rounding out, so that the transpose is the inverse to float64's precision. `owner` says in
    errors whose matrix it is.

    Raises:
        InputError: the matrix has no direction along an axis.
    """
    rigid = np.array(matrix, dtype=np.float64)
    if not np.isfinite(rigid).all():
        raise InputError(f"{owner} has a transform that is not finite; clear its transform")
    lengths = np.linalg.norm(rigid[:3, :3], axis=0)
    if not lengths.all():
        raise InputError(
            f"{owner} has the scale 0, and so looks nowhere; give it, or its parent, another scale"
        )
    left, _, right = np.linalg.svd(rigid[:3, :3] / lengths)
    rigid[:3, :3] = left @ right
    return rigid
