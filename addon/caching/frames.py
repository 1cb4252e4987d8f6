# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the frames of an animation: in each, the caching cameras that see a change.

Each frame is compared with the one that was looked at before it, the cache's first frame to begin
with. A camera that sees no change between the two has one picture for both.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from ..camplace.camera import CachingCamera
from ..progress import Progress, part_of
from ..scene.depsgraph_reader import viewport_depsgraph, with_render_depsgraph
from ..scene.geometry_reader import read_geometry
from ..scene.world_reader import read_world, render_world
from .aov_render import without_new_pictures
from .bake_cameras import Baked, CamerasBake
from .carry import numbered_materials, same_layout
from .fingerprint import read_state
from .frame_state import FrameState
from .linked_surfaces import local_stand_ins
from .plan import ChannelPlan
from .scene_state import SceneState
from .specialize import specialized
from .store import CacheStore
from .what_changed import ChangesInSight


@dataclass(frozen=True)
class _Looked:
    """A frame that was looked at, and what the cache holds of it.

    Attributes:
        state: the scene's.
        held: the file of each camera's picture (`FrameState.held`).
        cut_out: materials that light passes through; None if they are not known.
    """

    state: SceneState
    held: Mapping[int, str]
    cut_out: frozenset[str] | None


@dataclass
class FramesBake:
    """Frames of a scene, for a cache whose first frame is baked.

    Attributes:
        scene: a `bpy.types.Scene`.
        store: the cache.
        cameras: that are baked now.
        ambient_rays: rays of ambient occlusion from each texel; 0 for none.
        texel_samples: of each texel, whose mean its colours are.
        resume: keep what is there of the same frames.
        notes: a sentence for each thing that an artist should know of.
    """

    scene: Any
    store: CacheStore
    cameras: Sequence[CachingCamera]
    ambient_rays: int
    texel_samples: int
    resume: bool
    notes: list[str] = field(default_factory=list)
    _checked: set[str] = field(default_factory=set)

    def run(
        self, first: SceneState, frames: Sequence[int], baked: Baked, progress: Progress
    ) -> dict[int, list[int]]:
        """Bake frames; returns for each the ids of the cameras that were baked for it.

        The scene is at its own frame again afterwards.

        Args:
            first: the scene as the cache's first frame was baked.
            frames: in ascending order; the first one is passed over.
            baked: counts the pictures.
            progress: is asked before each camera.

        Raises:
            InputError: as `bake_scene`.
            Cancelled: raised by `progress`; what was finished is kept.
        """
        if not frames:
            return {}
        manifest = self.store.manifest
        held = {number: self.store.manifest.first_name(number) for number in manifest.finished}
        looked = _Looked(first, held, frozenset(manifest.cut_out))
        frames = [frame for frame in frames if frame != first.frame]
        told: dict[int, list[int]] = {}
        with own_frame(self.scene):
            for index, frame in enumerate(frames):
                step = part_of(progress, index / len(frames), (index + 1) / len(frames))
                step(0.0, f"Looking at frame {frame}")
                looked, told[frame] = self._bake(looked, self._look(frame), baked, step)
                self._bake_world(frame)
        return told

    def _look(self, frame: int) -> SceneState:
        self.scene.frame_set(frame)
        with without_new_pictures():
            geometry = with_render_depsgraph(self.scene, read_geometry)
        return read_state(geometry, frame)

    def _bake(
        self, before: _Looked, now: SceneState, baked: Baked, progress: Progress
    ) -> tuple[_Looked, list[int]]:
        """Bake what changed since the frame before."""
        known = self._known(now)
        earlier = self._view(before.state.frame)
        # Another process may have begun this frame, and numbered materials otherwise.
        begun = self._begun(now) or earlier
        plan = earlier.plan
        if now.fingerprint == before.state.fingerprint and begun.plan == plan:
            self._set(now, plan, {**self._of_ours(before.held), **known})
            return _Looked(now, self._held(now), before.cut_out), []
        wanted = {camera.id for camera in self.cameras}
        if wanted <= known.keys():
            return _Looked(now, known, None), []
        with self._specialized(begun, now) as bake:
            cut_out = frozenset(m.name for m in bake.materials if m.is_cut_out)
            todo, shared = self._divided(before, now, bake, cut_out, known)
            self._set(now, bake.plan, {**shared, **known})
            frame_progress = part_of(progress, 0.1, 1.0)
            bake.run(
                todo,
                lambda framebuffer, seen: self.store.add_frame_camera(now.frame, framebuffer, seen),
                baked,
                lambda share, text: frame_progress(share, f"Frame {now.frame}: {text}"),
            )
        return _Looked(now, self._held(now), cut_out), [camera.id for camera in todo]

    def _divided(
        self,
        before: _Looked,
        now: SceneState,
        bake: CamerasBake,
        cut_out: frozenset[str],
        known: Mapping[int, str],
    ) -> tuple[list[CachingCamera], dict[int, str]]:
        """The cameras that see a change, and the files of those that see none."""
        earlier = self._view(before.state.frame)
        if not same_layout(earlier.plan, bake.plan):
            self.notes.append(
                f"the materials of frame {now.frame} need other channels than those of frame "
                f"{before.state.frame}: every camera is baked at it"
            )
            return [camera for camera in self.cameras if camera.id not in known], {}
        either = None if before.cut_out is None else before.cut_out | cut_out
        sight = ChangesInSight(
            before.state.surfaces,
            now.surfaces,
            now.geometry,
            now.states,
            has_ambient="ambient_occlusion" in bake.plan.stored,
            cut_out=frozenset(bake.plan.material_names) if either is None else either,
        )
        todo: list[CachingCamera] = []
        shared: dict[int, str] = {}
        for camera in self.cameras:
            number = camera.id
            if number in known:
                continue
            seen = earlier.manifest.seen.get(number)
            if (
                number in before.held
                and self._is_intact(earlier, number)
                and not sight.reasons(camera, seen, partial(earlier.read_camera, number))
            ):
                shared[number] = before.held[number]
            else:
                todo.append(camera)
        return todo, shared

    def _begun(self, now: SceneState) -> CacheStore | None:
        """The cache at a frame that is begun already, in the state that it is in now."""
        state = self.store.manifest.frames.get(now.frame)
        if state is None or state.fingerprint != now.fingerprint:
            return None
        return self.store.at_frame(now.frame)

    def _known(self, now: SceneState) -> dict[int, str]:
        """What the cache holds of this frame already and need not be baked again."""
        view = self._begun(now)
        if not self.resume or view is None:
            return {}
        return {n: name for n, name in self._held(now).items() if self._is_intact(view, n)}

    def _is_intact(self, view: CacheStore, number: int) -> bool:
        """Whether a picture is as it was written; each file is read for that once."""
        if number not in view.manifest.finished:
            return False
        name = str(view.camera_path(number))
        if name not in self._checked and view.is_intact(number):
            self._checked.add(name)
        return name in self._checked

    def _of_ours(self, held: Mapping[int, str]) -> dict[int, str]:
        ours = {camera.id for camera in self.cameras}
        return {number: name for number, name in held.items() if number in ours}

    def _held(self, now: SceneState) -> Mapping[int, str]:
        return self.store.manifest.frames[now.frame].held

    def _view(self, frame: int) -> CacheStore:
        """The cache at a frame that was looked at."""
        frames = self.store.manifest.frames
        return self.store.at_frame(frame) if frame in frames else self.store

    def _set(self, now: SceneState, plan: ChannelPlan, held: Mapping[int, str]) -> None:
        same = plan == self.store.manifest.plan
        state = FrameState(now.fingerprint, None if same else plan, dict(held))
        self.store.set_frame(now.frame, state)

    @contextmanager
    def _specialized(self, begun: CacheStore, now: SceneState) -> Iterator[CamerasBake]:
        """`begun` numbers the materials that it has."""
        names = numbered_materials(begun, now.geometry.material_names)
        with (
            without_new_pictures(),
            local_stand_ins(),
            specialized(names, self.ambient_rays) as (plan, shown),
        ):
            yield CamerasBake(self.scene, now, plan, shown, self.ambient_rays, self.texel_samples)

    def _bake_world(self, frame: int) -> None:
        """The world's picture at this frame, if it is another than the first one's."""
        world = read_world(viewport_depsgraph(self.scene))
        if world is None or not world.needs_baking:
            return
        manifest = self.store.manifest
        known = manifest.frames[frame].world_fingerprint or manifest.world_fingerprint
        if known != world.fingerprint:
            with without_new_pictures():
                picture = render_world(self.scene)
            self.store.add_frame_world(frame, picture, world.fingerprint)


@contextmanager
def own_frame(scene: Any) -> Iterator[None]:
    """The scene at its own frame again when the block ends."""
    frame, part = scene.frame_current, scene.frame_subframe
    try:
        yield
    finally:
        scene.frame_set(frame, subframe=part)
