# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a dependency graph's meshes and instances into `SceneGeometry`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .cutout_reader import CutoutSource, read_cutout_source
from .geometry import Cutout, SceneGeometry

# Object types whose evaluated form is, or can be turned into, a mesh.
_MESH_TYPES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}

# Custom property on objects and materials: how much the artist cares, 0 to 1.
WEIGHT_PROPERTY = "relume_weight"

NO_MATERIAL = ""


@dataclass(frozen=True)
class _MeshArrays:
    """One evaluated mesh in its object's space."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    slot: NDArray[np.int32]
    uv: dict[str, NDArray[np.float32]]
    active_uv: str


def read_geometry(depsgraph: Any) -> SceneGeometry:
    """All that Cycles would render as triangles from this dependency graph.

    Left out: holdouts, non-finite and degenerate triangles (counted in a warning), and
    geometry that has no mesh (hair, point clouds, volumes; named in a warning).

    Raises:
        InputError: the scene shows no triangle.
    """
    meshes: dict[Any, _MeshArrays | None] = {}
    parts: list[tuple[_MeshArrays, NDArray[np.float64], int, NDArray[np.int32], bool, bool]] = []
    object_names: list[str] = []
    object_weights: list[float] = []
    materials: dict[str, int] = {}
    cutouts: dict[str, CutoutSource | None] = {}
    weights: dict[str, float] = {}
    warnings: dict[str, None] = {}

    for instance in depsgraph.object_instances:
        if not instance.show_self:
            continue
        evaluated = instance.object
        original = evaluated.original
        if evaluated.type not in _MESH_TYPES:
            if evaluated.type in {"CURVES", "POINTCLOUD", "VOLUME"}:
                warnings[
                    f"object '{original.name}' is {evaluated.type.lower()}, which is not shown yet"
                ] = None
            continue
        if evaluated.is_holdout or original.holdout_get(view_layer=depsgraph.view_layer_eval):
            warnings[f"object '{original.name}' is a holdout and was left out"] = None
            continue
        key = evaluated.data.session_uid if evaluated.data is not None else original.session_uid
        if evaluated.type != "MESH":
            key = (original.session_uid, key)
        if key not in meshes:
            meshes[key] = _read_mesh(evaluated)
        mesh = meshes[key]
        if mesh is None:
            continue
        slots = _slot_materials(evaluated)
        for material in slots:
            name = material.name if material is not None else NO_MATERIAL
            if name not in materials:
                materials[name] = len(materials)
                weights[name] = _weight(material)
                cutouts[name] = read_cutout_source(material) if material is not None else None
                source = cutouts[name]
                if source is not None and source.problem:
                    warnings[f"material '{name}': {source.problem}"] = None
        material_of_slot = np.array(
            [materials[m.name if m is not None else NO_MATERIAL] for m in slots], dtype=np.int32
        )
        world_from_object = np.array(instance.matrix_world, dtype=np.float64)
        object_index = len(object_names)
        object_names.append(original.name)
        object_weights.append(_weight(original))
        parts.append(
            (
                mesh,
                world_from_object,
                object_index,
                material_of_slot,
                bool(evaluated.visible_camera),
                bool(evaluated.visible_shadow),
            )
        )

    if not parts:
        raise InputError(
            "the scene has no mesh that renders; add one, or enable it for renders in the outliner"
        )
    return _assemble(parts, object_names, object_weights, materials, weights, cutouts, warnings)


def _assemble(
    parts: list[tuple[_MeshArrays, NDArray[np.float64], int, NDArray[np.int32], bool, bool]],
    object_names: list[str],
    object_weights: list[float],
    materials: dict[str, int],
    weights: dict[str, float],
    cutouts: dict[str, CutoutSource | None],
    warnings: dict[str, None],
) -> SceneGeometry:
    material_names = list(materials)
    uv_map_of_material = [
        source.uv_map if (source := cutouts[name]) is not None else None for name in material_names
    ]
    needs_uv = any(name is not None for name in uv_map_of_material)
    vertices, triangles, object_id, material_id, camera, shadow, uv = [], [], [], [], [], [], []
    offset = 0
    for mesh, world_from_object, object_index, material_of_slot, see, cast in parts:
        rotation = world_from_object[:3, :3]
        vertices.append(mesh.vertices @ rotation.T + world_from_object[:3, 3])
        # A mirrored object's corners run the other way round.
        winding = mesh.triangles if np.linalg.det(rotation) >= 0.0 else mesh.triangles[:, ::-1]
        triangles.append(winding + np.int32(offset))
        offset += len(mesh.vertices)
        count = len(mesh.triangles)
        slot = np.minimum(mesh.slot, len(material_of_slot) - 1)
        ids = material_of_slot[slot]
        material_id.append(ids)
        object_id.append(np.full(count, object_index, dtype=np.int32))
        camera.append(np.full(count, see))
        shadow.append(np.full(count, cast))
        if needs_uv:
            part_uv = np.zeros((count, 3, 2), dtype=np.float32)
            for index in np.unique(ids):
                wanted = uv_map_of_material[index]
                layer = mesh.uv.get(wanted or mesh.active_uv) if wanted is not None else None
                if layer is not None:
                    part_uv[ids == index] = layer[ids == index]
            uv.append(part_uv if winding is mesh.triangles else part_uv[:, ::-1])

    all_vertices = np.concatenate(vertices)
    all_triangles = np.concatenate(triangles)
    all_objects = np.concatenate(object_id)
    all_materials = np.concatenate(material_id)
    # Only finite vertices may be multiplied; 0 * inf would raise a warning of numpy's own.
    finite_vertex = np.isfinite(all_vertices).all(axis=1)
    finite = finite_vertex[all_triangles].all(axis=1)
    if not finite.all():
        broken = sorted({object_names[i] for i in np.unique(all_objects[~finite])})
        warnings[
            f"{int((~finite).sum())} triangles with coordinates that are not finite were left "
            f"out ({', '.join(broken[:5])}{' …' if len(broken) > 5 else ''})"
        ] = None
        all_vertices = np.where(finite_vertex[:, None], all_vertices, 0.0)
    corner = all_vertices[all_triangles]
    doubled_area = np.linalg.norm(
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
    )
    keep = finite & (doubled_area > 0.0)
    if not keep.any():
        raise InputError("every triangle of the scene is degenerate; give the meshes an area")
    material_weight = np.array([weights[name] for name in material_names])
    weight = np.array(object_weights)[all_objects] * material_weight[all_materials]
    return SceneGeometry(
        vertices=all_vertices,
        triangles=all_triangles[keep],
        object_id=all_objects[keep],
        material_id=all_materials[keep],
        weight=weight[keep].astype(np.float32),
        camera_visible=np.concatenate(camera)[keep],
        shadow_visible=np.concatenate(shadow)[keep],
        uv=np.concatenate(uv)[keep] if needs_uv else None,
        object_names=tuple(object_names),
        material_names=tuple(material_names),
        cutouts=tuple(
            Cutout(materials[name], source.alpha, source.extension)
            for name, source in cutouts.items()
            if source is not None and source.uv_map is not None
        ),
        warnings=tuple(warnings),
    )


def _read_mesh(evaluated: Any) -> _MeshArrays | None:
    mesh = evaluated.to_mesh()
    if mesh is None:
        return None
    try:
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        if not count:
            return None
        vertices = np.empty(len(mesh.vertices) * 3, dtype=np.float32)
        mesh.vertices.foreach_get("co", vertices)
        triangles = np.empty(count * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        slot = np.empty(count, dtype=np.int32)
        mesh.loop_triangles.foreach_get("material_index", slot)
        loops = np.empty(count * 3, dtype=np.int32)
        mesh.loop_triangles.foreach_get("loops", loops)
        uv: dict[str, NDArray[np.float32]] = {}
        active = ""
        for layer in mesh.uv_layers:
            values = np.empty(len(mesh.loops) * 2, dtype=np.float32)
            layer.uv.foreach_get("vector", values)
            uv[layer.name] = values.reshape(-1, 2)[loops].reshape(count, 3, 2)
            if layer.active_render:
                active = layer.name
        return _MeshArrays(
            vertices.reshape(-1, 3).astype(np.float64), triangles.reshape(-1, 3), slot, uv, active
        )
    finally:
        evaluated.to_mesh_clear()


def _slot_materials(evaluated: Any) -> list[Any]:
    """The original material of each slot; at least one entry, None for no material."""
    slots = [slot.material for slot in evaluated.material_slots]
    if not slots and evaluated.data is not None:
        slots = list(getattr(evaluated.data, "materials", []))
    return [m.original if m is not None else None for m in slots] or [None]


def _weight(block: Any) -> float:
    if block is None:
        return 1.0
    value = block.get(WEIGHT_PROPERTY, 1.0)
    return float(min(max(value, 0.0), 1.0)) if isinstance(value, int | float) else 1.0


class _DepsgraphProbe(bpy.types.RenderEngine):
    """A render engine that draws nothing: Blender hands it the graph as a render sees it."""

    bl_idname = "RELUME_PROBE"
    bl_label = "Relume Probe"
    bl_use_postprocess = False

    callback: Callable[[Any], None] | None = None
    failure: BaseException | None = None

    def render(self, depsgraph: Any) -> None:
        try:
            if _DepsgraphProbe.callback is not None:
                _DepsgraphProbe.callback(depsgraph)
        except BaseException as failure:
            _DepsgraphProbe.failure = failure


def with_render_depsgraph[T](scene: Any, function: Callable[[Any], T]) -> T:
    """Call `function` with the scene's dependency graph evaluated for a render.

    The graph that Python can ask for directly is the viewport's, with other modifier levels
    and other hidden objects. Only for background use: it runs a render of `scene`, whose
    engine is put back afterwards.
    """
    results: list[T] = []
    engine = scene.render.engine
    bpy.utils.register_class(_DepsgraphProbe)
    _DepsgraphProbe.callback = lambda depsgraph: results.append(function(depsgraph))
    _DepsgraphProbe.failure = None
    try:
        scene.render.engine = _DepsgraphProbe.bl_idname
        bpy.ops.render.render(scene=scene.name)
        if _DepsgraphProbe.failure is not None:
            raise _DepsgraphProbe.failure
    finally:
        scene.render.engine = engine
        _DepsgraphProbe.callback = None
        _DepsgraphProbe.failure = None
        bpy.utils.unregister_class(_DepsgraphProbe)
    if not results:
        raise InputError(f"scene '{scene.name}' could not be evaluated for rendering")
    return results[0]
