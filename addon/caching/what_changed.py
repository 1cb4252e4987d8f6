# SPDX-License-Identifier: GPL-3.0-or-later
"""What changed between two states of a scene, and which caching cameras see it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..camplace.frame import LocalFrame
from ..camplace.rays import RayCaster
from ..scene.geometry import SceneGeometry
from .ambient_reach import AmbientReach
from .framebuffer import DeepFramebuffer
from .seen_surfaces import Seen
from .surfaces import ObjectState, Surfaces
from .triangles_of import triangles_of

# What lies behind a baked depth by no more than this share of it counts as before it: the depth
# is of float32 and of a sample up to a hundredth of a texel away (see `seen_surfaces`).
_BEHIND = 1e-3


@dataclass(frozen=True)
class Changes:
    """The difference of two states.

    Attributes:
        gone: objects as they no longer are.
        come: objects as they were not before.
        materials: names of those that are in both and differ.
    """

    gone: tuple[ObjectState, ...]
    come: tuple[ObjectState, ...]
    materials: frozenset[str]

    @classmethod
    def between(cls, earlier: Surfaces, now: Surfaces) -> Changes:
        """From one state to another."""
        return cls(
            tuple(o for key, o in earlier.objects.items() if key not in now.objects),
            tuple(o for key, o in now.objects.items() if key not in earlier.objects),
            frozenset(
                name
                for name in earlier.materials.keys() & now.materials.keys()
                if earlier.materials[name].digest != now.materials[name].digest
            ),
        )

    def __bool__(self) -> bool:
        return bool(self.gone or self.come or self.materials)

    @property
    def moved(self) -> tuple[ObjectState, ...]:
        """Objects whose shape, place or existence changed, as they were and as they are."""
        gone, come = ({state.shape for state in some} for some in (self.gone, self.come))
        were = (state for state in self.gone if state.shape not in come)
        return (*were, *(state for state in self.come if state.shape not in gone))

    @property
    def names(self) -> tuple[str, ...]:
        """What changed, as it is told: object 'Chair', material 'Wood'."""
        objects = {_object(state.name) for state in (*self.gone, *self.come)}
        return (*sorted(objects), *sorted(map(_material, self.materials)))


def surely_stale(earlier: Surfaces, now: Surfaces, seen: Mapping[int, Seen]) -> int:
    """How many pictures show an object or a material as it no longer is: a quick look, which
    leaves out those before which something new came."""
    changes = Changes.between(earlier, now)
    gone = {state.digest for state in changes.gone}
    return sum(
        bool(shown.objects & gone or shown.materials & changes.materials) for shown in seen.values()
    )


class ChangesInSight:
    """Tells which caching cameras' pictures of an earlier state are no longer true.

    A picture shows a change if it shows an object or a material as it no longer is, or if a
    new or a changed surface lies before what it shows, or at it: all else that it shows is as it
    was, and nothing came before it.
    """

    def __init__(
        self,
        earlier: Surfaces,
        now: Surfaces,
        geometry: SceneGeometry,
        states: Sequence[ObjectState],
        *,
        has_ambient: bool,
        cut_out: frozenset[str],
    ) -> None:
        """Compare two states.

        Args:
            earlier: what the pictures were baked from.
            now: what the scene is like.
            geometry: its triangles now.
            states: of `geometry.object_names`.
            has_ambient: whether pictures hold ambient occlusion, which is of all that is near.
            cut_out: names of the materials that rays may pass through, now or before.
        """
        self.changes = Changes.between(earlier, now)
        self._geometry = geometry
        self._states = states
        self._has_ambient = has_ambient
        self._cut_out = cut_out
        self._near_by = frozenset(
            name
            for surfaces in (earlier, now)
            for name, material in surfaces.materials.items()
            if material.feels_near
        )
        self._gone = {state.digest: state for state in self.changes.gone}
        come = {state.digest for state in self.changes.come}
        self._object_came = np.array([state.digest in come for state in states])
        materials = [name in self.changes.materials for name in geometry.material_names]
        self._material_changed = np.array(materials)

    def reasons(
        self, camera: CachingCamera, seen: Seen | None, read: Callable[[], DeepFramebuffer]
    ) -> tuple[str, ...]:
        """What a picture shows that changed, as `Changes.names`; nothing if it is still true.

        Args:
            camera: whose picture it is.
            seen: what it shows; None if that is not known.
            read: gives the picture; called only if that is needed.
        """
        if not self.changes:
            return ()
        if seen is None or not seen.is_complete:
            return self.changes.names
        found = {_object(self._gone[digest].name) for digest in seen.objects & self._gone.keys()}
        found |= {_material(name) for name in seen.materials & self.changes.materials}
        if seen.materials & self._near_by:
            found |= {_object(state.name) for state in self.changes.moved}
        if found:
            return tuple(sorted(found))
        picture: DeepFramebuffer | None = None
        if self._may_be_in_view(camera):
            picture = read()
            for number, each in enumerate(picture.pictures):
                found |= self._before(camera, each, is_behind=number > 0)
        if not found and self._has_ambient and self._reach.moved:
            picture = picture or read()
            for each in picture.pictures:
                found |= {_object(name) for name in self._reach.reasons(each)}
        return tuple(sorted(found))

    @cached_property
    def _changed(self) -> NDArray[np.int64]:
        """The triangles that are new or of a changed material."""
        changed = self._object_came[self._geometry.object_id]
        return np.flatnonzero(changed | self._material_changed[self._geometry.material_id])

    @cached_property
    def _frame(self) -> LocalFrame:
        return LocalFrame.of(self._geometry, (), None)

    @cached_property
    def _caster(self) -> RayCaster:
        return RayCaster(
            self._frame.geometry_from_world(triangles_of(self._geometry, self._changed))
        )

    @cached_property
    def _corners(self) -> NDArray[np.float64]:
        """(N, 3) world-space corners of the changed triangles, each once."""
        return self._geometry.vertices[np.unique(self._geometry.triangles[self._changed])]

    @cached_property
    def _reach(self) -> AmbientReach:
        """Of what came, went or moved; and of what a change of material may have opened."""
        opened = [
            index
            for index, name in enumerate(self._geometry.material_names)
            if name in self.changes.materials & self._cut_out
        ]
        of_opened = np.unique(self._geometry.object_id[np.isin(self._geometry.material_id, opened)])
        moved = [*self.changes.moved, *(self._states[i] for i in of_opened)]
        solid = np.array([name not in self._cut_out for name in self._geometry.material_names])
        still = ~self._object_came[self._geometry.object_id] & solid[self._geometry.material_id]
        return AmbientReach(triangles_of(self._geometry, np.flatnonzero(still)), moved)

    def _may_be_in_view(self, camera: CachingCamera) -> bool:
        """Whether a changed triangle may lie within the picture's pyramid: not if all corners
        are beyond one of its sides."""
        if not self._changed.size:
            return False
        matrix = camera.world_from_camera
        x, y, z = ((self._corners - camera.origin) @ matrix[:3, :3]).T
        side = -z * camera.half_extent * (1.0 + _BEHIND)
        outside = (x > side, x < -side, y > side, y < -side, -z < camera.near, -z > camera.far)
        return not any(bool(beyond.all()) for beyond in outside)

    def _before(
        self, camera: CachingCamera, picture: DeepFramebuffer, *, is_behind: bool = False
    ) -> set[str]:
        """The changed triangles that lie before a picture's depth, by what changed of them; of one
        of what `is_behind` where it shows anything."""
        depth = picture.channels["depth"][..., 0].astype(np.float64)
        nothing = 0.0 if is_behind else camera.far
        depth = np.where(depth > 0.0, depth * (1.0 + _BEHIND), nothing)
        found = self._met(camera, depth)
        # Rays may miss what is finer than a texel: its corners do not.
        lowest, size = np.zeros(2, np.int64), camera.resolution
        projected = camera.project(self._corners)
        inside = (projected[:, 2] >= camera.near) & (np.abs(projected[:, :2] - 0.5) <= 0.5).all(1)
        texel = np.floor(projected[inside, :2] * size).astype(np.int64)
        column, row = np.clip(texel, lowest, size - 1).T
        shown = projected[inside, 2] <= depth[row, column]
        used = np.unique(self._geometry.triangles[self._changed])[inside][shown]
        if used.size:
            touched = np.isin(self._geometry.triangles[self._changed], used).any(axis=1)
            found = np.union1d(found, self._changed[touched])
        return self._names_of(found)

    def _met(self, camera: CachingCamera, depth: NDArray[np.float64]) -> NDArray[np.int64]:
        """The changed triangles that rays through the texels' centres meet before a depth."""
        size = camera.resolution
        local = self._frame.camera_from_world(camera)
        centre = (np.arange(size) + 0.5) / size
        u, v = np.meshgrid(centre, centre)
        place = local.unproject(np.stack([u, v, np.ones_like(u)], axis=-1)).reshape(-1, 3)
        way = place - local.origin
        length = np.linalg.norm(way, axis=-1)
        direction = way / length[:, None]
        # From the near clip on; a distance along the ray is `length` times the depth.
        start = local.origin + (local.near * length)[:, None] * direction
        end = (depth.ravel() / self._frame.unit - local.near) * length
        hit = self._caster.first_hit(start, direction, np.maximum(end, 0.0)).triangle
        return self._changed[np.unique(hit[hit >= 0])]

    def _names_of(self, triangles: NDArray[np.int64]) -> set[str]:
        objects = np.unique(self._geometry.object_id[triangles])
        materials = np.unique(self._geometry.material_id[triangles])
        names = {_object(self._states[i].name) for i in objects if self._object_came[i]}
        changed = self._material_changed
        return names | {
            _material(self._geometry.material_names[i]) for i in materials if changed[i]
        }


def _object(name: str) -> str:
    return f"object '{name}'"


def _material(name: str) -> str:
    return f"material '{name}'"
