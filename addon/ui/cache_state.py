# SPDX-License-Identifier: GPL-3.0-or-later
"""What the panel says about a scene's cache.

Panels are drawn many times a second, so the manifest is read again only when it changed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..caching.edited_cameras import PLACEMENT_NAME
from ..caching.manifest_file import MANIFEST_NAME
from ..caching.plan import ChannelPlan
from ..caching.presets import PRESETS
from ..caching.store import CacheStore
from ..camplace.camera import CachingCamera
from ..camplace.cameras_file import read_cameras
from ..camplace.settings import RESOLUTIONS
from ..errors import InputError
from .cache_folder import cache_folder
from .cache_stamp import cache_stamp
from .viewport_warnings import viewport_warnings


@dataclass(frozen=True)
class CacheState:
    """A few lines for the panel.

    Attributes:
        summary: one line.
        icon: Blender's icon for it.
        details: more lines.
        approximations: one for each material that is not cached as Cycles shows it.
        warnings: one for each thing else that viewports leave out or approximate.
        placed: what was placed last.
        cameras: the cache's, finished or not.
        largest: the highest resolution that they may have, texels along a side.
        plan: what it holds of each material; None without a cache.
    """

    summary: str
    icon: str
    details: tuple[str, ...] = ()
    approximations: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    placed: tuple[CachingCamera, ...] = ()
    cameras: tuple[CachingCamera, ...] = ()
    largest: int = RESOLUTIONS[-1]
    plan: ChannelPlan | None = None


_last: tuple[tuple[Path, int, int], CacheState] | None = None
# What of the scene no longer was what a cache was baked from, when a picture was last drawn.
_stale: dict[tuple[Path, int], tuple[str, ...]] = {}


def note_staleness(folder: Path, stamp: int, sentences: tuple[str, ...]) -> None:
    """Comparing a scene with its cache takes too long for a panel: who does, says so here.

    Args:
        folder: the cache's.
        stamp: its `cache_stamp`.
        sentences: what of the scene is no longer as it was baked.
    """
    _stale.clear()
    _stale[folder, stamp] = sentences


def read_cache_state(scene: Any) -> CacheState:
    """The state of a scene's cache, from the manifest, and what viewports said of it."""
    global _last  # noqa: PLW0603 - a memory of the one thing asked for again and again
    try:
        folder = cache_folder(scene)
    except InputError as error:
        return CacheState(f"No cache: {error}", "INFO")
    key = (folder, cache_stamp(folder), cache_stamp(folder, PLACEMENT_NAME))
    if _last is None or _last[0] != key:
        _last = (key, _read(folder, placed=key[2] != 0))
    state = replace(_last[1], warnings=viewport_warnings(folder))
    if sentences := _stale.get(key[:2]):
        details = tuple(f"Stale: {sentence}" for sentence in sentences)
        return replace(state, icon="ERROR", details=details)
    if (key[:2] in _stale) and not state.details:
        return replace(state, details=("Current: baked from the scene as it is",))
    return state


def with_changes(state: CacheState, sentence: str) -> CacheState:
    """The same state, with what became of the scene's caching cameras since; "" for nothing."""
    if not sentence:
        return state
    told = state.details if state.icon == "ERROR" else ()
    return replace(state, icon="ERROR", details=(*told, sentence))


def _read_placed(folder: Path, *, placed: bool) -> tuple[CachingCamera, ...]:
    try:
        return read_cameras(folder / PLACEMENT_NAME) if placed else ()
    except InputError:  # Place and Bake say so
        return ()


def _read(folder: Path, *, placed: bool) -> CacheState:
    if not (folder / MANIFEST_NAME).exists():
        text = "Cameras are placed; not baked yet" if placed else "Nothing is baked yet"
        return CacheState(text, "INFO")
    try:
        store = CacheStore.open(folder)
    except InputError as error:
        return CacheState(str(error), "ERROR")
    manifest = store.manifest
    baked, wanted = len(manifest.finished), len(manifest.cameras)
    preset = manifest.settings.get("preset")
    size = sum(record.size for record in manifest.finished.values())
    size += manifest.world.size if manifest.world is not None else 0
    if baked < wanted:
        summary, icon = f"{baked} of {wanted} cameras baked", "INFO"
    else:
        summary, icon = f"{baked} cameras baked", "CHECKMARK"
    return CacheState(
        f"{summary} ({size / 2**20:.1f} MB)",
        icon,
        approximations=tuple(str(item) for item in store.plan.approximations),
        placed=_read_placed(folder, placed=placed),
        cameras=manifest.cameras,
        largest=PRESETS[preset].max_resolution if preset in PRESETS else RESOLUTIONS[-1],
        plan=store.plan,
    )
