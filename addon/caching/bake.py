# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the deep framebuffers of a scene into a cache."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..progress import Progress, part_of, silent
from ..scene.geometry import SceneGeometry
from ..scene.world_reader import read_world, render_world
from .aov_render import without_new_pictures
from .bake_cameras import Baked, CamerasBake
from .bake_report import BakeReport
from .bake_settings import BakeSettings, earlier_cache, prepare_store
from .carry import Carrier, numbered_materials, same_layout
from .fingerprint import read_state
from .frames import FramesBake
from .linked_surfaces import local_stand_ins
from .manifest import Manifest
from .plan_report import value_notes
from .presets import PRESETS, Preset
from .scene_state import SceneState
from .specialize import specialized
from .store import CacheStore

__all__ = ["BakeReport", "BakeSettings", "Preset", "bake_scene"]


def bake_scene(  # noqa: PLR0917 - the order that every caller knows
    scene: Any,
    geometry: SceneGeometry,
    cameras: Sequence[CachingCamera],
    folder: Path,
    settings: BakeSettings | None = None,
    progress: Progress = silent,
) -> BakeReport:
    """Bake caching cameras of the open file's `scene`, a `bpy.types.Scene`.

    The scene is left as it was found, also when `progress` raises or Cycles fails. Each camera
    is on the disk, and in the manifest, before the next one begins. `settings.frames` are baked
    after the current one, which the cache begins with.

    Raises:
        InputError: the folder belongs to another scene or cannot be written, or a material
            gives values that are not finite.
        Cancelled: raised by `progress`; finished cameras are kept.
    """
    settings = settings or BakeSettings()
    started = time.monotonic()
    fineness = PRESETS[settings.preset]
    largest = fineness.max_resolution
    fitted = tuple(replace(c, resolution=min(c.resolution, largest)) for c in cameras)
    _check_ids(settings.only, fitted)
    progress(0.0, "Reading the scene")
    world = _world(scene)
    state = read_state(geometry, int(scene.frame_current))
    bake = _Bake(scene, state, fitted, Path(folder), settings)
    ambient_rays = fineness.occlusion_rays if world is not None and not world.is_black else 0
    first_share = 1.0 / (1 + len(settings.frames))
    done = bake.first_frame(ambient_rays, started, part_of(progress, 0.0, first_share))
    store, baked, carrier = done.store, done.baked, done.carrier
    seconds = {"prepare": done.preparing}
    if world is not None and world.needs_baking:
        started = time.monotonic()
        _bake_world(scene, world.fingerprint, store, progress)
        seconds["world"] = time.monotonic() - started
    first = baked.cameras
    frames = FramesBake(
        scene, store, done.wanted, ambient_rays, fineness.texel_samples, resume=settings.resume
    )
    told = frames.run(state, settings.frames, baked, part_of(progress, first_share, 1.0))
    progress(1.0, f"{len(store.cameras)} of {len(fitted)} cameras baked")
    manifest = store.manifest
    records = [*manifest.finished.values(), *(p.record for p in manifest.pictures.values())]
    return BakeReport(
        cameras=len(fitted),
        baked=first,
        kept=len(done.wanted) - first,
        texels=baked.texels,
        plan=store.plan,
        precisions=baked.precisions,
        raw_bytes=baked.raw_bytes,
        stored_bytes=baked.stored_bytes,
        cache_bytes=sum(record.size for record in records),
        seconds={**seconds, **baked.seconds},
        changed=carrier.changed,
        again=carrier.again,
        frames=told,
        notes=(*carrier.notes, *frames.notes, *value_notes(store.plan)),
    )


@dataclass(frozen=True)
class _FirstFrame:
    """What became of the frame that a cache begins with."""

    store: CacheStore
    carrier: Carrier
    baked: Baked
    wanted: tuple[CachingCamera, ...]
    preparing: float


@dataclass(frozen=True)
class _Bake:
    """What is to be baked, and where to."""

    scene: Any
    state: SceneState
    cameras: tuple[CachingCamera, ...]
    folder: Path
    settings: BakeSettings

    def first_frame(self, ambient_rays: int, started: float, progress: Progress) -> _FirstFrame:
        """Bake the scene as it is now, into the cache that it goes on with or begins.

        Materials keep the numbers that the pictures of an earlier bake have for them. If those
        pictures are of no use, they are numbered anew, which leaves out those that are gone.
        """
        settings = self.settings
        goes_on = settings.resume or settings.only is not None
        earlier = None
        if goes_on:
            state = self.state
            earlier = earlier_cache(self.folder, state.surfaces, state.fingerprint, settings)
        names = self.state.geometry.material_names
        numbered = numbered_materials(earlier, names)
        if numbered != names and earlier is not None:
            with self._specialized(numbered, ambient_rays) as bake:
                if same_layout(earlier.plan, bake.plan):
                    return self._bake(bake, started, progress)
        with self._specialized(names, ambient_rays) as bake:
            return self._bake(bake, started, progress)

    @contextmanager
    def _specialized(self, names: Sequence[str], ambient_rays: int) -> Iterator[CamerasBake]:
        with (
            without_new_pictures(),
            local_stand_ins(),
            specialized(names, ambient_rays) as (plan, shown),
        ):
            samples = PRESETS[self.settings.preset].texel_samples
            yield CamerasBake(self.scene, self.state, plan, shown, ambient_rays, samples)

    def _bake(self, bake: CamerasBake, started: float, progress: Progress) -> _FirstFrame:
        settings = self.settings
        carrier = Carrier(self.state)
        manifest = Manifest(
            self.state.fingerprint,
            {"preset": settings.preset},
            bake.plan,
            self.cameras,
            surfaces=self.state.surfaces,
            cut_out=tuple(m.name for m in bake.materials if m.is_cut_out),
            frame=self.state.frame,
        )
        progress(0.0, "Comparing the scene with the cache")
        store = prepare_store(self.folder, manifest, settings, carrier)
        only = settings.only
        wanted = tuple(c for c in self.cameras if only is None or c.id in only)
        todo = [c for c in wanted if not (settings.resume and store.is_intact(c.id))]
        preparing = time.monotonic() - started
        baked = Baked()
        bake.run(todo, store.add_camera, baked, part_of(progress, 0.02, 0.96))
        return _FirstFrame(store, carrier, baked, wanted, preparing)


def _world(scene: Any) -> Any:
    import bpy

    with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
        return read_world(bpy.context.evaluated_depsgraph_get())


def _check_ids(only: frozenset[int] | None, cameras: Sequence[CachingCamera]) -> None:
    unknown = sorted((only or frozenset()) - {camera.id for camera in cameras})
    if unknown:
        raise InputError(
            f"there is no caching camera {unknown[0]}; the placement has "
            f"{cameras[0].id} to {cameras[-1].id}"
        )


def _bake_world(scene: Any, fingerprint: str, store: CacheStore, progress: Progress) -> None:
    """The world's picture, unless the cache has it already."""
    if not store.has_world(fingerprint):
        progress(0.97, "Rendering the world")
        with without_new_pictures():
            picture = render_world(scene)
        store.add_world(picture, fingerprint)
