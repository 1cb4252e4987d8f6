# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes with known surfaces, and deep framebuffers traced with embree instead of baked.

Channels are functions of world position, so what a view reads through the cache can be
compared with the function itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from numpy.typing import NDArray

from addon.caching.framebuffer import DeepFramebuffer
from addon.camplace.camera import CachingCamera
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View

Color = Callable[[NDArray[np.float64]], NDArray[np.float64]]
Point = Sequence[float] | NDArray[np.float64]

_CUBE_FACES = np.array(
    [[0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
     [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5]]
)  # fmt: skip


def box(center: Point, size: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """An axis-aligned cube: (8, 3) vertices and (12, 3) triangles."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return np.asarray(center) + 0.5 * size * corners, _CUBE_FACES


def geometry_of(
    parts: Sequence[tuple[NDArray[np.float64], NDArray[np.int64]]],
) -> SceneGeometry:
    """One object and one material for each part."""
    vertices = np.concatenate([part[0] for part in parts])
    offsets = np.cumsum([0, *(len(part[0]) for part in parts[:-1])])
    triangles = np.concatenate([p[1] + o for p, o in zip(parts, offsets, strict=True)])
    part_id = np.repeat(np.arange(len(parts)), [len(part[1]) for part in parts]).astype(np.int32)
    names = tuple(f"part {i}" for i in range(len(parts)))
    return SceneGeometry(
        vertices=vertices,
        triangles=triangles.astype(np.int32),
        object_id=part_id,
        material_id=part_id,
        weight=np.ones(len(triangles), dtype=np.float32),
        camera_visible=np.ones(len(triangles), dtype=bool),
        shadow_visible=np.ones(len(triangles), dtype=bool),
        object_names=names,
        material_names=names,
    )


def room_with_box(scale: float = 1.0, offset: Point = (0.0, 0.0, 0.0)) -> SceneGeometry:
    """A closed room 4 x 4 x 4 with a cube of 1 that floats a little off its middle."""
    geometry = geometry_of([box((0, 0, 0), 4.0), box((0.3, 0.2, -0.6), 1.0)])
    moved = geometry.vertices * scale + np.asarray(offset)
    return SceneGeometry(**{**geometry.__dict__, "vertices": moved})


def looking_at(place: Point, target: Point, up: Point = (0, 0, 1)) -> NDArray[np.float64]:
    """(4, 4) world_from_camera of a camera at `place` that looks at `target`."""
    back = np.asarray(place, dtype=np.float64) - np.asarray(target, dtype=np.float64)
    back /= np.linalg.norm(back)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    world_from_camera[:3, 3] = place
    return world_from_camera


def perspective_view(
    world_from_camera: NDArray[np.float64],
    width: int,
    height: int,
    fov: float,
    *,
    near: float = 0.01,
    far: float = 100.0,
) -> View:
    """A view whose horizontal angle is `fov` radians."""
    f = 1.0 / np.tan(0.5 * fov)
    clip_from_camera = np.zeros((4, 4))
    clip_from_camera[0, 0] = f
    clip_from_camera[1, 1] = f * width / height
    clip_from_camera[2, 2] = -(far + near) / (far - near)
    clip_from_camera[2, 3] = -2.0 * far * near / (far - near)
    clip_from_camera[3, 2] = -1.0
    return View(world_from_camera, clip_from_camera, width, height)


def cube_cameras(
    center: Point, resolution: int, first_id: int = 0, far: float = 100.0
) -> list[CachingCamera]:
    """Six 90 degree faces round a point."""
    axes = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    return [
        CachingCamera(
            id=first_id + i,
            world_from_camera=looking_at(
                center, np.add(center, axis), (0, 1, 0) if axis[2] else (0, 0, 1)
            ),
            fov=0.5 * np.pi,
            near=far * 1e-5,
            far=far,
            resolution=resolution,
            kind="CUBE_FACE",
            source=0,
        )
        for i, axis in enumerate(axes)
    ]


class Tracer:
    """Closest hits by embree; rays are made relative to the geometry's middle first."""

    def __init__(self, geometry: SceneGeometry) -> None:
        self._geometry = geometry
        self._origin = geometry.bounds.mean(axis=0)
        corners = (geometry.vertices - self._origin)[geometry.triangles].astype(np.float32)
        self._scene = rtcore_scene.EmbreeScene()
        TriangleMesh(self._scene, corners)

    def hit(
        self, origins: NDArray[np.float64], directions: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """(N,) triangle or -1, and (N, 3) hit point in float64 on the triangle's own plane."""
        result = self._scene.run(
            (origins - self._origin).astype(np.float32), directions.astype(np.float32)
        )
        triangle = np.asarray(result, dtype=np.int64)
        corner = self._geometry.vertices[self._geometry.triangles[triangle, 0]]
        normal = self._geometry.normal[triangle]
        with np.errstate(divide="ignore", invalid="ignore"):
            along = ((corner - origins) * normal).sum(1) / (directions * normal).sum(1)
        return triangle, origins + along[:, None] * directions


def trace_framebuffer(
    geometry: SceneGeometry, tracer: Tracer, camera: CachingCamera, color: Color
) -> DeepFramebuffer:
    """What a bake would store: depth, material_id, normal and diffuse_color at texel centres."""
    size = camera.resolution
    centre = (np.arange(size) + 0.5) / size
    u, v = np.meshgrid(centre, centre)
    points = camera.unproject(np.stack([u, v, np.ones_like(u)], axis=-1)).reshape(-1, 3)
    direction = points - camera.origin
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    triangle, where = tracer.hit(np.broadcast_to(camera.origin, direction.shape), direction)
    hit = triangle >= 0
    depth = np.where(hit, camera.project(where)[:, 2], 0.0)
    normal = geometry.normal[triangle]
    normal = np.where((normal * direction).sum(1, keepdims=True) > 0.0, -normal, normal)
    values = {
        "depth": depth[:, None],
        "material_id": np.where(hit, geometry.material_id[triangle] + 1, 0)[:, None],
        "normal": np.where(hit[:, None], normal, 0.0),
        "diffuse_color": np.where(hit[:, None], color(where), 0.0),
    }
    return DeepFramebuffer(
        camera,
        {name: value.reshape(size, size, -1).astype(np.float32) for name, value in values.items()},
    )
