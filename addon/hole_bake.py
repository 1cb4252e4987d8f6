# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes caching cameras for the holes of a view, into the temporary pictures beside a cache.

The whole scene is baked from these cameras, and not only the objects that are seen through the
holes, as the paper has it (Kim, Kyung, Lee 2009, III.3): what is near a surface has a say in its
ambient occlusion and in some nodes, and hiding 727 of 774 objects of a staircase left three fifths
of the time.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from .caching.aov_render import without_new_pictures
from .caching.bake_cameras import Baked, CamerasBake
from .caching.carry import numbered_materials
from .caching.file_record import FileRecord
from .caching.fingerprint import read_state
from .caching.framebuffer import DeepFramebuffer
from .caching.linked_surfaces import local_stand_ins
from .caching.presets import PRESETS
from .caching.seen_surfaces import Seen
from .caching.specialize import specialized
from .caching.store import CacheStore
from .caching.temporary_store import TemporaryStore
from .camplace.camera import CachingCamera
from .errors import InputError
from .progress import Progress
from .scene.geometry import SceneGeometry
from .writable import require_folder


def bake_holes(
    scene: Any,
    geometry: SceneGeometry,
    cache: CacheStore,
    cameras: Sequence[CachingCamera],
    progress: Progress,
    *,
    together: Collection[int] = (),
) -> tuple[int, ...]:
    """Bake cameras of the open file's `scene`, a `bpy.types.Scene`, at its current frame.

    The scene is left as it was found. What is finished when `progress` raises stays.

    Args:
        scene: whose objects are baked.
        geometry: its triangles, as a render has them.
        cache: whose channels and materials the pictures have.
        cameras: what to bake.
        progress: is told how far it is.
        together: numbers of temporary pictures that do not give way to these, as these do not to
            one another.

    Returns:
        The pictures' numbers in the cache's `TemporaryStore`.

    Raises:
        InputError: the cache is of another scene, or of this one as it was, or cannot be written.
        Cancelled: raised by `progress`.
    """
    state = read_state(geometry, int(scene.frame_current))
    store = cache.showing(state.fingerprint, state.frame)
    temporary = TemporaryStore(store)
    require_folder(temporary.folder)
    numbers: list[int] = []

    def keep(framebuffer: DeepFramebuffer, seen: Seen) -> FileRecord:  # noqa: ARG001
        numbers.append(temporary.add(framebuffer, {*together, *numbers}))
        return FileRecord(0, "")

    names = numbered_materials(store, state.geometry.material_names)
    rays = _ambient_rays(store)
    with (
        without_new_pictures(),
        local_stand_ins(),
        specialized(names, rays) as (plan, materials),
    ):
        if plan != store.plan:
            raise InputError(
                f"{store.folder} was baked with other channels than its scene has now; bake it "
                "again before its holes are filled"
            )
        bake = CamerasBake(
            scene, state, plan, materials, rays, _texel_samples(store), tells_what_is_seen=False
        )
        bake.run(cameras, keep, Baked(), progress)
    return tuple(numbers)


def _ambient_rays(store: CacheStore) -> int:
    """As the cache was baked: with how many rays of ambient occlusion, if any."""
    if not store.plan.uses("ambient_occlusion"):
        return 0
    preset = store.manifest.settings.get("preset")
    return PRESETS[preset].occlusion_rays if preset in PRESETS else 0


def _texel_samples(store: CacheStore) -> int:
    """As the cache was baked: of how many samples its colours are means."""
    preset = store.manifest.settings.get("preset")
    return PRESETS[preset].texel_samples if preset in PRESETS else 1
