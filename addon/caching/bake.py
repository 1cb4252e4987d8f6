# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the deep framebuffers of a scene into a cache."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..progress import Progress, silent
from ..scene.geometry import SceneGeometry
from ..scene.geometry_reader import NO_MATERIAL
from ..scene.world_reader import read_world, render_world
from ..time_left import time_left
from .aov_render import staged, without_new_pictures
from .bake_camera import bake_camera
from .bake_report import BakeReport
from .bake_settings import BakeSettings, prepare_store
from .file_record import FileRecord
from .fingerprint import scene_fingerprint
from .framebuffer import DeepFramebuffer
from .linked_surfaces import local_stand_ins
from .presets import PRESETS, Preset
from .ray_occlusion import OcclusionCaster
from .specialize import SpecializedMaterial, needs_sky, specialized
from .store import CacheStore, Manifest

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
    is on the disk, and in the manifest, before the next one begins.

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
    fingerprint = scene_fingerprint(geometry)
    ambient_rays = fineness.occlusion_rays if world is not None else 0
    with (
        without_new_pictures(),
        local_stand_ins(),
        specialized(geometry.material_names, ambient_rays) as (plan, shown),
    ):
        manifest = Manifest(fingerprint, {"preset": settings.preset}, plan, fitted)
        store = prepare_store(Path(folder), manifest, settings)
        seconds = {"prepare": time.monotonic() - started}
        wanted = [c for c in fitted if settings.only is None or c.id in settings.only]
        kept = [c for c in wanted if settings.resume and store.is_intact(c.id)]
        todo = [c for c in wanted if c not in kept]
        sky_rays = ambient_rays if needs_sky(plan, shown) else 0
        occlusion = OcclusionCaster(geometry, ambient_rays)
        baked = _bake_cameras(
            scene, store, todo, shown, occlusion, sky_rays=sky_rays, progress=progress
        )
    if world is not None and world.needs_baking:
        started = time.monotonic()
        _bake_world(scene, world.fingerprint, store, progress)
        seconds["world"] = time.monotonic() - started
    progress(1.0, f"{len(store.cameras)} of {len(fitted)} cameras baked")
    return BakeReport(
        cameras=len(fitted),
        baked=len(todo),
        kept=len(kept),
        texels=sum(c.resolution**2 for c in todo),
        plan=plan,
        precisions=baked.precisions,
        raw_bytes=baked.raw_bytes,
        stored_bytes=baked.stored_bytes,
        cache_bytes=sum(record.size for record in store.manifest.finished.values()),
        seconds={**seconds, **baked.seconds},
    )


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


@dataclass
class _Baked:
    """What the cameras took: bytes, seconds by stage, and channels by their precisions."""

    raw_bytes: int = 0
    stored_bytes: int = 0
    seconds: dict[str, float] = field(default_factory=dict)
    precisions: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))

    def add(self, framebuffer: DeepFramebuffer, record: FileRecord) -> None:
        """Count one camera's picture and file."""
        self.raw_bytes += framebuffer.raw_bytes
        self.stored_bytes += record.size
        for name in framebuffer.channels:
            self.precisions[name][framebuffer.precision(name)] += 1


def _bake_cameras(
    scene: Any,
    store: CacheStore,
    cameras: Sequence[CachingCamera],
    materials: Sequence[SpecializedMaterial],
    occlusion: OcclusionCaster,
    *,
    sky_rays: int,
    progress: Progress,
) -> _Baked:
    baked = _Baked()
    if not cameras:
        return baked
    texels = [camera.resolution**2 for camera in cameras]
    timed: list[tuple[int, float]] = []
    writing = 0.0
    has_default = NO_MATERIAL in store.plan.material_names
    with staged(scene, store.plan.stored, has_normal=has_default, sky_rays=sky_rays) as stage:
        for number, camera in enumerate(cameras, start=1):
            done = len(timed)
            left = time_left(timed, texels[done:])
            message = f"Baking camera {number} of {len(cameras)}{left}"
            progress(0.02 + 0.94 * sum(texels[:done]) / sum(texels), message)
            started = time.monotonic()
            framebuffer = bake_camera(stage, camera, store.plan, materials, occlusion)
            rendered = time.monotonic()
            record = store.add_camera(framebuffer)
            written = time.monotonic()
            baked.add(framebuffer, record)
            writing += written - rendered
            timed.append((camera.resolution**2, written - started))
        seconds = stage.seconds
        finishing = sum(took for _, took in timed) - sum(seconds.values()) - writing
        baked.seconds = {**seconds, "finish": finishing, "write": writing}
    return baked
