# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface that each pixel of a view sees (paper III.3, first step).

The paper projects a depth map back into the scene; here the rasterizer hands over position,
normal and material themselves, which costs nothing more and loses no precision.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..glsl.shader import PassShader, Texture, framebuffer, texture_2d
from ..glsl.uniforms import Field, UniformBlock
from ..scene.view import View
from .geometry_buffer import GeometryBuffer, build_raster_program

_EYE_BLOCK = UniformBlock("eye", (Field("vec4", "place"),))

_PASS = PassShader(
    name="visible_surface",
    fragment="visible_surface",
    blocks=(_EYE_BLOCK,),
    outputs=(("VEC4", "visible_position"), ("VEC4", "visible_normal")),
)
_PASS_WITH_OBJECTS = replace(_PASS, outputs=(*_PASS.outputs, ("FLOAT", "visible_object")))


@dataclass(frozen=True)
class VisibleSurface:
    """One sample of the view, before anything was read from the cache.

    Attributes:
        position: RGBA32F, xyz local position in metres, w = 1 + material id or 0 for nothing.
        normal: RGBA32F, xyz unit geometric normal that faces the viewer.
        eye: (4,) float64: the camera's local place with w = 1, or for a parallel projection
            the unit direction toward the camera with w = 0.
        objects: R32F, 1 + object id (exact: fewer than 2^24), 0 for nothing; if asked for.
    """

    position: Texture
    normal: Texture
    eye: NDArray[np.float64]
    objects: Texture | None = None


class VisibleSurfacePass:
    """Rasterizes views of one scene."""

    def __init__(self, geometry: GeometryBuffer) -> None:
        self._geometry = geometry
        self._program = build_raster_program(_PASS, geometry.has_cutouts)

    def draw(
        self,
        view: View,
        offset: tuple[float, float] = (0.0, 0.0),
        *,
        with_objects: bool = False,
    ) -> VisibleSurface:
        """The surfaces at the pixels' centres, moved by `offset` pixels (x, y)."""
        program, targets = self._program, []
        if with_objects:
            program = build_raster_program(_PASS_WITH_OBJECTS, self._geometry.has_cutouts, True)
            targets.append(texture_2d(view.width, view.height, "R32F"))
        position = texture_2d(view.width, view.height)
        normal = texture_2d(view.width, view.height)
        depth = texture_2d(view.width, view.height, "DEPTH_COMPONENT32F")
        eye = local_eye(view, self._geometry.origin)
        target = framebuffer([position, normal, *targets], depth)
        with target.bind():
            target.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
            self._geometry.draw(
                program,
                clip_from_local(view, self._geometry.origin, offset),
                "camera",
                uniforms={"eye": {"place": eye}},
            )
        return VisibleSurface(position, normal, eye, *targets)


def local_eye(view: View, origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4,) float64, see `VisibleSurface.eye`."""
    if view.perspective:
        return np.append(view.origin - origin, 1.0)
    return np.append(view.world_from_camera[:3, 2], 0.0)


def clip_from_local(
    view: View, origin: NDArray[np.float64], offset: tuple[float, float] = (0.0, 0.0)
) -> NDArray[np.float64]:
    """(4, 4) float64, the view's clip space from local space.

    A sample `offset` pixels right of and above the pixel's centre comes to lie on the centre,
    so the picture is moved the other way.
    """
    camera_from_local = view.camera_from_world.copy()
    # Composed by differences: the world's coordinates may be millions of metres.
    camera_from_local[:3, 3] = view.world_from_camera[:3, :3].T @ (origin - view.origin)
    shift = np.eye(4)
    shift[0, 3] = -2.0 * offset[0] / view.width
    shift[1, 3] = -2.0 * offset[1] / view.height
    return shift @ view.clip_from_camera @ camera_from_local
