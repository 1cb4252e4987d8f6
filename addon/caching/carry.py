# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake keeps of an earlier one, after the scene or its caching cameras changed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial

from .manifest import Manifest
from .plan import ChannelPlan
from .scene_state import SceneState
from .store import CacheStore
from .surfaces import Surfaces
from .what_changed import ChangesInSight

# What of a plan may differ between the pictures of one cache: constants are the plan's own, and
# the pictures of a camera that sees no change hold none of a material that has other ones. Normals
# are in the pictures wherever they are read.
_FREE = ("constants", "material_constants", "material_names", "approximations", "mesh_normals")


@dataclass
class Carrier:
    """Carries what is still true from an earlier cache into a new manifest.

    Attributes:
        state: the scene as it is; without it nothing of one that changed is kept.
        changed: what changed in the scene since the earlier bake: object 'Chair', material 'Wood'.
        again: what of it each camera sees that is baked again for it, by camera id.
        notes: a sentence for each thing that could not be kept for another reason.
    """

    state: SceneState | None = None
    changed: tuple[str, ...] = ()
    again: dict[int, tuple[str, ...]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def carried(self, earlier: CacheStore, wanted: Manifest) -> Manifest:
        """`wanted`, begun with what `earlier` has finished and is still true."""
        known = earlier.manifest
        if known.settings != wanted.settings:
            return wanted
        wanted = replace(wanted, world=known.world, world_fingerprint=known.world_fingerprint)
        if not self._same_channels(known, wanted):
            self.notes.append(
                "the materials or the world need other channels than those that were baked: every "
                "camera is baked again"
            )
            return wanted
        before = {camera.id: camera.to_json() for camera in known.cameras}
        same = [
            camera.id
            for camera in wanted.cameras
            if camera.id in known.finished and before[camera.id] == camera.to_json()
        ]
        if known.fingerprint == wanted.fingerprint:
            frames = {
                number: replace(state, held={n: h for n, h in state.held.items() if n in same})
                for number, state in known.frames.items()
            }
            wanted = replace(wanted, frame=known.frame, frames=frames, pictures=known.pictures)
        else:
            same = self._unaffected(earlier, wanted, same)
            if known.frames:
                self.notes.append(
                    "the other frames of the cache are of the scene before it changed, and go; "
                    "bake them again with --frames"
                )
        return replace(
            wanted,
            finished={number: known.finished[number] for number in same},
            seen={number: known.seen[number] for number in same if number in known.seen},
        )

    def _unaffected(self, earlier: CacheStore, wanted: Manifest, same: list[int]) -> list[int]:
        """Of some cameras those whose pictures show nothing that changed."""
        known = earlier.manifest
        if self.state is None:
            return []
        sight = ChangesInSight(
            known.surfaces,
            self.state.surfaces,
            self.state.geometry,
            self.state.states,
            has_ambient="ambient_occlusion" in wanted.plan.stored,
            cut_out=frozenset((*known.cut_out, *wanted.cut_out)),
        )
        self.changed = sight.changes.names
        kept = []
        for camera in wanted.cameras:
            # A damaged picture is baked again whatever it shows.
            if camera.id not in same or not earlier.is_intact(camera.id):
                continue
            number = camera.id
            read = partial(earlier.read_camera, number)
            reasons = sight.reasons(camera, known.seen.get(number), read)
            if reasons:
                self.again[number] = reasons
            else:
                kept.append(number)
        return kept

    @staticmethod
    def _same_channels(known: Manifest, wanted: Manifest) -> bool:
        if known.fingerprint == wanted.fingerprint:
            return known.plan == wanted.plan
        return same_layout(known.plan, wanted.plan)


def same_layout(earlier: ChannelPlan, now: ChannelPlan) -> bool:
    """Whether pictures that were baked with either plan can be read with the later one."""
    before, after = earlier.to_json(), now.to_json()
    count = len(earlier.material_names)
    return now.material_names[:count] == earlier.material_names and all(
        before.get(key) == value for key, value in after.items() if key not in _FREE
    )


def is_same_scene(earlier: Surfaces, now: Surfaces) -> bool:
    """Whether two states may be of one scene: an object is as it was, or most names are there."""
    if earlier.objects.keys() & now.objects.keys():
        return True
    names, names_now = _names(earlier), _names(now)
    return bool(names) and 2 * len(names & names_now) >= len(names)


def _names(surfaces: Surfaces) -> set[str]:
    return {state.name for state in surfaces.objects.values()}


def numbered_materials(earlier: CacheStore | None, names: tuple[str, ...]) -> tuple[str, ...]:
    """The scene's materials in the order in which a cache numbers them: those that it numbers
    already first, also those that nothing uses any more."""
    if earlier is None:
        return names
    known = earlier.plan.material_names
    return (*known, *(name for name in names if name not in known))
