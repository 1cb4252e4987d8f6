# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes for the demo's furniture, in metres, made with bmesh and numpy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

Vec = tuple[float, float, float]
Points = NDArray[np.float64]

# Faces that meet at more than this are not shaded smoothly across their edge.
SHARP = math.radians(40.0)


def place(
    mesh: Any, name: str, materials: Sequence[Any], at: Vec = (0, 0, 0), turn: Vec = (0, 0, 0)
) -> Any:
    """Put a mesh into the scene with these materials, at a place, turned by Euler angles."""
    for material in materials:
        mesh.materials.append(material)
    obj = bpy.data.objects.new(name, mesh)
    obj.location = at
    obj.rotation_euler = turn
    bpy.data.scenes[0].collection.objects.link(obj)
    return obj


def _finish(bm: Any, name: str, *, smooth: bool) -> Any:
    mesh: Any = bpy.data.meshes.new(name)
    bm.to_mesh(mesh)
    bm.free()
    mesh.polygons.foreach_set("use_smooth", np.full(len(mesh.polygons), smooth))
    if smooth:
        mesh.set_sharp_from_angle(angle=SHARP)
    return mesh


def _add_box(bm: Any, center: Vec, size: Vec, turn: Vec = (0, 0, 0), slot: int = 0) -> None:
    rotation = Matrix.Rotation(turn[2], 4, "Z") @ Matrix.Rotation(turn[1], 4, "Y")
    rotation = rotation @ Matrix.Rotation(turn[0], 4, "X")
    matrix = Matrix.Translation(center) @ rotation @ Matrix.Diagonal((*size, 1.0))
    made = bmesh.ops.create_cube(bm, size=1.0, matrix=matrix)
    for face in {face for vertex in made["verts"] for face in vertex.link_faces}:
        face.material_index = slot


def boxes(name: str, parts: Sequence[tuple[Any, ...]], bevel: float = 0.0) -> Any:
    """Boxes as one mesh: a tuple (center, size[, turn[, material slot]]) each.

    `bevel` rounds every edge by that width.
    """
    bm = bmesh.new()
    for part in parts:
        _add_box(bm, *part)
    if bevel > 0.0:
        bmesh.ops.bevel(
            bm, geom=list(bm.edges), offset=bevel, segments=2, profile=0.5, affect="EDGES"
        )
    return _finish(bm, name, smooth=False)


def lathe(name: str, profile: Sequence[tuple[float, float]], segments: int = 48) -> Any:
    """A profile of (radius, height) turned about Z; a radius of 0 closes it."""
    bm = bmesh.new()
    chain = [bm.verts.new((radius, 0.0, height)) for radius, height in profile]
    edges = [bm.edges.new(pair) for pair in itertools.pairwise(chain)]
    bmesh.ops.spin(
        bm, geom=[*chain, *edges], cent=(0, 0, 0), axis=(0, 0, 1), angle=2 * math.pi,
        steps=segments, use_duplicate=False, use_merge=True,
    )  # fmt: skip
    # Points on the axis were turned into rings of no size: relative to the whole, one point.
    size = max(max(abs(radius), abs(height)) for radius, height in profile)
    bmesh.ops.remove_doubles(bm, verts=list(bm.verts), dist=1e-5 * size)
    bmesh.ops.recalc_face_normals(bm, faces=list(bm.faces))
    return _finish(bm, name, smooth=True)


def curve_profile(
    points: Sequence[tuple[float, float]], steps: int = 8
) -> list[tuple[float, float]]:
    """A Catmull-Rom curve through (radius, height) points, for `lathe`."""
    p = np.array([points[0], *points, points[-1]], dtype=np.float64)
    t = np.linspace(0.0, 1.0, steps, endpoint=False)[:, None]
    # The four weights of the uniform Catmull-Rom basis, (steps, 1) each.
    weights = (-t + 2 * t**2 - t**3, 2 - 5 * t**2 + 3 * t**3, t + 4 * t**2 - 3 * t**3, t**3 - t**2)
    windows = zip(p, p[1:], p[2:], p[3:], strict=False)
    pieces = [0.5 * sum(w * q for w, q in zip(weights, four, strict=True)) for four in windows]
    curve = np.concatenate([*pieces, p[-1:]])
    return [(max(0.0, float(r)), float(h)) for r, h in curve]


def sphere(name: str, radius: float, segments: int = 32) -> Any:
    """A UV sphere."""
    bm = bmesh.new()
    bmesh.ops.create_uvsphere(bm, u_segments=segments, v_segments=segments // 2, radius=radius)
    return _finish(bm, name, smooth=True)


def monkey(name: str, size: float) -> Any:
    """Suzanne, subdivided twice by Blender's own modifier when the scene is evaluated."""
    bm = bmesh.new()
    bmesh.ops.create_monkey(bm, matrix=Matrix.Scale(size, 4))
    return _finish(bm, name, smooth=True)


def _sheet(rows: int, columns: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A grid of quads over the unit square: points (N, 2), and faces (F, 4)."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    index = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    faces = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1)
    return np.stack([u.ravel(), v.ravel()], axis=-1), faces.reshape(-1, 4)


def _with_uv(name: str, points: Points, faces: NDArray[np.int64], uv: Points) -> Any:
    """A mesh of points (N, 3), quads (F, 4) and texture coordinates of the points (N, 2)."""
    mesh: Any = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], faces.tolist())
    layer = mesh.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", uv[faces.ravel()].astype(np.float32).ravel())
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), dtype=bool))
    mesh.update()
    return mesh


def sheet(name: str, width: float, height: float) -> Any:
    """An upright rectangle in X and Z with its image the right way up, standing at z = 0."""
    uv, faces = _sheet(1, 1)
    points = np.stack([(uv[:, 0] - 0.5) * width, np.zeros(4), uv[:, 1] * height], axis=-1)
    return _with_uv(name, points, faces, uv)


def carpet(name: str, width: float, depth: float) -> Any:
    """A rectangle on the ground, with its image."""
    uv, faces = _sheet(1, 1)
    points = np.stack([(uv[:, 0] - 0.5) * width, (uv[:, 1] - 0.5) * depth, np.zeros(4)], axis=-1)
    return _with_uv(name, points, faces, uv)


def leaves(name: str, count: int, length: float, seed: int) -> Any:
    """Arching leaves around the origin, each a strip with the leaf's image."""
    random = np.random.default_rng(seed)
    uv, faces = _sheet(10, 4)
    turn = 2 * np.pi * (np.arange(count) * 0.381966 + 0.03 * random.random(count))  # golden angle
    rise = np.radians(random.uniform(28.0, 78.0, count))
    size = length * random.uniform(0.65, 1.0, count)
    along, across = uv[:, 1], (uv[:, 0] - 0.5) * 0.34
    # Each leaf sets out at its angle and bends down to the ground by its own weight.
    outward = along * np.cos(rise)[:, None]
    height = along * np.sin(rise)[:, None] - 0.55 * along**2
    fold = np.abs(across) * 0.25
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    points = size[:, None, None] * np.stack(
        [outward * c - across * s, outward * s + across * c, height + fold], axis=-1
    )
    first = len(uv) * np.arange(count)[:, None, None]
    return _with_uv(
        name, points.reshape(-1, 3), (faces + first).reshape(-1, 4), np.tile(uv, (count, 1))
    )


def look_at(at: Vec, target: Vec) -> Any:
    """Euler angles that turn a camera or a light at `at` towards `target`."""
    return (Vector(target) - Vector(at)).to_track_quat("-Z", "Y").to_euler()
