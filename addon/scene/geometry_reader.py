# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a dependency graph's meshes and instances into `SceneGeometry`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .copies_finder import FlatTriangles, find_copies
from .cutout_reader import CutoutSource, read_cutout_source
from .geometry import Cutout, SceneGeometry, Sheer
from .mesh_reader import MESH_TYPES, WEIGHT_NAME, MeshArrays, read_mesh
from .octahedral import to_codes
from .surface_state_reader import instance_state

# The name under which triangles without a material are kept.
NO_MATERIAL = ""

# What is farther away than this, in metres, is as good as infinite: farther than Jupiter, and
# beside things ten times as far a set of a metre vanishes in what float32 holds of areas.
FARTHEST = 1e12

# Triangles whose area is computed at once; memory stays small beside the mesh's own.
_CHUNK = 1 << 18

# Geometry that Cycles renders and that has no triangles to read.
_NOT_A_MESH = {"CURVES", "POINTCLOUD", "VOLUME"}


def read_geometry(depsgraph: Any) -> SceneGeometry:
    """All that Cycles would render as triangles from this dependency graph.

    Left out: holdouts, non-finite triangles (counted in a warning) and degenerate ones, and
    geometry that has no mesh (hair, point clouds, volumes; named in a warning). A triangle's
    weight is the product of its object's, its instancer's, its material's and its mesh's; a
    custom property that is no weight is named in a warning.

    Raises:
        InputError: the scene shows no triangle.
    """
    collector = _Collector()
    for instance in depsgraph.object_instances:
        if instance.show_self:
            collector.add(instance, depsgraph.view_layer_eval)
    if not collector.parts:
        raise InputError(
            "the scene has no mesh that renders; add one, or enable it for renders in the outliner"
        )
    return _clean(collector)


@dataclass(frozen=True)
class _Part:
    """One object or instance."""

    mesh: MeshArrays
    world_from_object: NDArray[np.float64]
    material_of_slot: NDArray[np.int32]
    name: str
    weight: float
    camera_visible: bool
    shadow_visible: bool
    state: bytes
    full_names: tuple[str, str]
    terminator_offset: float

    def vertices(self) -> NDArray[np.float64]:
        """(V, 3) world space."""
        rotation = self.world_from_object[:3, :3]
        return self.mesh.vertices @ rotation.T + self.world_from_object[:3, 3]

    @property
    def is_mirrored(self) -> bool:
        """Whether the corners of its triangles run the other way round in world space."""
        return bool(np.linalg.det(self.world_from_object[:3, :3]) < 0.0)

    def triangles(self) -> NDArray[np.int32]:
        """(T, 3), wound so that the normal stays on the artist's side."""
        return self.mesh.triangles[:, ::-1] if self.is_mirrored else self.mesh.triangles

    def material_id(self) -> NDArray[np.int32]:
        """(T,) indices into the scene's materials."""
        return self.material_of_slot[np.minimum(self.mesh.slot, len(self.material_of_slot) - 1)]

    def corner_normals(self) -> NDArray[np.float64] | None:
        """(T, 3, 3) world space, of any length; None where every face is flat."""
        normals = self.mesh.corner_normals
        if normals is None:
            return None
        x, y, z = self.world_from_object[:3, :3].T
        # The inverse transpose times the determinant, which a matrix without an inverse has too.
        cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)])
        turned = normals.astype(np.float64) @ (-cofactors if self.is_mirrored else cofactors)
        return turned[:, ::-1] if self.is_mirrored else turned

    def weights(self) -> NDArray[np.float32]:
        """(T,) what the artist painted on the mesh; 1 where nothing is."""
        if self.mesh.weight is None:
            return np.ones(len(self.mesh.triangles), dtype=np.float32)
        return self.mesh.weight

    def uv(self, map_of_material: list[str | None]) -> NDArray[np.float32]:
        """(T, 3, 2): each triangle's coordinates in the map that its material's mask uses."""
        ids = self.material_id()
        result = np.zeros((len(ids), 3, 2), dtype=np.float32)
        for index in np.unique(ids):
            wanted = map_of_material[index]
            if wanted is not None:
                layer = self.mesh.uv.get(wanted or self.mesh.active_uv)
                if layer is not None:
                    result[ids == index] = layer[ids == index]
        return result[:, ::-1] if self.is_mirrored else result


class _Collector:
    """What a walk over the instances finds."""

    def __init__(self) -> None:
        self.parts: list[_Part] = []
        self.materials: dict[str, int] = {}
        self.material_weights: list[float] = []
        self.cutouts: list[CutoutSource | None] = []
        # A dict keeps the order and drops repetitions.
        self.warnings: dict[str, None] = {}
        self._meshes: dict[Any, MeshArrays | None] = {}

    def warn(self, sentence: str) -> None:
        self.warnings[sentence] = None

    def add(self, instance: Any, view_layer: Any) -> None:
        evaluated = instance.object
        original = evaluated.original
        if evaluated.type in _NOT_A_MESH:
            self.warn(
                f"object '{original.name}' is {evaluated.type.lower()}, which is not shown yet"
            )
        if evaluated.type not in MESH_TYPES:
            return
        if any(_is_hair(system.settings) for system in getattr(evaluated, "particle_systems", ())):
            self.warn(f"object '{original.name}' has particle hair, which is not shown yet")
        # Cycles asks who instances an object, and not the object, whether it is held out; its
        # ray visibility counts with that of its instancer.
        instancer = instance.parent if instance.is_instance else evaluated
        if instancer.holdout_get(view_layer=view_layer):
            self.warn(f"object '{original.name}' is a holdout and was left out")
            return
        mesh = self._mesh(evaluated)
        if mesh is None:
            return
        if evaluated.shadow_terminator_shading_offset > 0.0:
            self.warn(
                f"object '{original.name}': its shadow terminator's shading offset is not shown; "
                "its geometry offset is"
            )
        self.parts.append(
            _Part(
                mesh,
                np.array(instance.matrix_world, dtype=np.float64),
                np.array([self._material(m) for m in _slot_materials(evaluated)], dtype=np.int32),
                original.name,
                self._weights(original, instancer.original),
                bool(evaluated.visible_camera and instancer.visible_camera)
                and not instancer.indirect_only_get(view_layer=view_layer),
                bool(evaluated.visible_shadow and instancer.visible_shadow),
                mesh.state + instance_state(instance, evaluated, instancer, WEIGHT_NAME),
                (instancer.original.name_full if instance.is_instance else "", original.name_full),
                evaluated.shadow_terminator_geometry_offset,
            )
        )

    def _mesh(self, evaluated: Any) -> MeshArrays | None:
        key = evaluated.data.session_uid if evaluated.type == "MESH" else evaluated.name_full
        if key not in self._meshes:
            self._meshes[key] = read_mesh(evaluated)
        return self._meshes[key]

    def _material(self, material: Any) -> int:
        # Materials of different libraries may have the same name.
        name = material.name_full if material is not None else NO_MATERIAL
        if name not in self.materials:
            self.materials[name] = len(self.materials)
            weight = 1.0 if material is None else self._weight(material, f"material '{name}'")
            self.material_weights.append(weight)
            source = read_cutout_source(material) if material is not None else None
            self.cutouts.append(source)
            if source is not None and source.problem:
                self.warn(f"material '{name}': {source.problem}")
        return self.materials[name]

    def _weights(self, original: Any, instancer: Any) -> float:
        """An object's weight, times that of another object that instances it."""
        weight = self._weight(original, f"object '{original.name}'")
        if instancer != original:
            weight *= self._weight(instancer, f"object '{instancer.name}'")
        return weight

    def _weight(self, block: Any, owner: str) -> float:
        """The artist's weight of an object or material; 1 where none is set."""
        value = block.get(WEIGHT_NAME, 1.0)
        if not isinstance(value, int | float) or np.isnan(value):
            self.warn(f"{owner}: its {WEIGHT_NAME} is not a number; 1 is taken instead")
            return 1.0
        weight = float(min(max(value, 0.0), 1.0))
        if weight != value:
            self.warn(
                f"{owner}: its {WEIGHT_NAME} is {value}, which is not from 0 to 1; "
                f"{weight:g} is taken instead"
            )
        return weight


def _shared(parts: Sequence[_Part]) -> NDArray[np.bool_]:
    """(O,) which parts show a mesh that others show too."""
    shown = Counter(id(part.mesh) for part in parts)
    return np.array([shown[id(part.mesh)] > 1 for part in parts], dtype=np.bool_)


def _clean(collector: _Collector) -> SceneGeometry:
    """Join the parts, leaving out triangles that cannot be used."""
    parts = collector.parts
    counts = [len(part.mesh.triangles) for part in parts]
    offsets = np.cumsum([0, *(len(part.mesh.vertices) for part in parts[:-1])]).astype(np.int32)
    # Infinity times a rotation's zero is not a number.
    with np.errstate(invalid="ignore"):
        vertices = np.concatenate([part.vertices() for part in parts])
    triangles = np.concatenate(
        [part.triangles() + offset for part, offset in zip(parts, offsets, strict=True)]
    )
    object_id = np.repeat(np.arange(len(parts), dtype=np.int32), counts)
    material_id = np.concatenate([part.material_id() for part in parts])

    with np.errstate(invalid="ignore"):
        finite_vertex = (np.abs(vertices) < FARTHEST).all(axis=1)
    finite = finite_vertex[triangles].all(axis=1)
    if not finite.all():
        broken = sorted({parts[i].name for i in np.unique(object_id[~finite])})
        collector.warn(
            f"{int((~finite).sum())} triangles with coordinates that are not finite, or beyond "
            f"{FARTHEST:.0e} m, were left out "
            f"({', '.join(broken[:5])}{' …' if len(broken) > 5 else ''})"
        )
        vertices = np.where(finite_vertex[:, None], vertices, 0.0)
    keep = finite & _have_area(vertices, triangles)
    if not keep.any():
        raise InputError("every triangle of the scene is degenerate; give the meshes an area")

    map_of_material = [source.uv_map if source else None for source in collector.cutouts]
    uv = None
    if any(name is not None for name in map_of_material):
        uv = np.concatenate([part.uv(map_of_material) for part in parts])[keep]
    corner_normals = _corner_normals(parts, vertices, triangles)
    is_smooth = corner_normals is not None
    copies = find_copies(parts, FlatTriangles(keep, material_id[keep], uv, is_smooth))
    sheer = [i for i, source in enumerate(collector.cutouts) if source and source.is_sheer]
    object_weight = np.array([part.weight for part in parts])
    weight = object_weight[object_id] * np.array(collector.material_weights)[material_id]
    if any(part.mesh.weight is not None for part in parts):
        weight *= np.concatenate([part.weights() for part in parts])
    return SceneGeometry(
        vertices=vertices,
        triangles=triangles[keep],
        object_id=object_id[keep],
        material_id=material_id[keep],
        weight=weight[keep].astype(np.float32),
        camera_visible=np.repeat([part.camera_visible for part in parts], counts)[keep],
        shadow_visible=np.repeat([part.shadow_visible for part in parts], counts)[keep],
        uv=uv,
        object_names=tuple(part.name for part in parts),
        material_names=tuple(collector.materials),
        cutouts=tuple(
            Cutout(index, source.alpha, source.extension)
            for index, source in enumerate(collector.cutouts)
            if source is not None and source.uv_map is not None and not source.is_sheer
        ),
        sheers=tuple(
            Sheer(index, source.transmission, source.extension, source.outside)
            for index, source in enumerate(collector.cutouts)
            if source is not None and source.transmission is not None and source.outside is not None
        ),
        warnings=tuple(collector.warnings),
        object_states=tuple(part.state for part in parts),
        full_names=tuple(part.full_names for part in parts),
        corner_normals=None if corner_normals is None else corner_normals[keep],
        shares_mesh=_shared(parts),
        terminator_offset=np.array([part.terminator_offset for part in parts], dtype=np.float32),
        # What light passes through in part is drawn one by one.
        copies=tuple(c for c in copies if not np.isin(c.material_id, sheer).any()),
    )


def _corner_normals(
    parts: list[_Part], vertices: NDArray[np.float64], triangles: NDArray[np.int32]
) -> NDArray[np.uint16] | None:
    """(T, 3, 2) codes of what is interpolated for shading; None where every face is flat."""
    if all(part.mesh.corner_normals is None for part in parts):
        return None
    codes = np.empty((len(triangles), 3, 2), dtype=np.uint16)
    end = 0
    for part in parts:
        first, end = end, end + len(part.mesh.triangles)
        normals = part.corner_normals()
        for start in range(first, end, _CHUNK):
            some = slice(start, min(start + _CHUNK, end))
            a, b, c = (vertices[corner] for corner in triangles[some].T)
            flat = np.cross(b - a, c - a)[:, None]
            if normals is None:
                codes[some] = to_codes(flat)
                continue
            smooth = normals[some.start - first : some.stop - first]
            size = np.linalg.norm(smooth, axis=-1, keepdims=True)
            usable = np.isfinite(size) & (size > 0.0)
            codes[some] = to_codes(np.where(usable, smooth, flat))
    return codes


def _have_area(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(T,) whether each triangle's corners span a plane."""
    result = np.empty(len(triangles), dtype=np.bool_)
    for start in range(0, len(triangles), _CHUNK):
        a, b, c = (vertices[corner] for corner in triangles[start : start + _CHUNK].T)
        result[start : start + _CHUNK] = np.cross(b - a, c - a).any(axis=1)
    return result


def _is_hair(settings: Any) -> bool:
    """Whether a particle system is rendered as strands."""
    return bool(settings.type == "HAIR" and settings.render_type == "PATH")


def _slot_materials(evaluated: Any) -> list[Any]:
    """The original material of each slot; at least one entry, None for no material."""
    slots = [slot.material for slot in evaluated.material_slots]
    if not slots and evaluated.data is not None:
        slots = list(getattr(evaluated.data, "materials", []))
    return [m.original if m is not None else None for m in slots] or [None]
