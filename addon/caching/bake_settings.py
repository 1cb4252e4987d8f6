# SPDX-License-Identifier: GPL-3.0-or-later
"""What may be chosen about a bake, and the cache that a choice goes on with or begins."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

from ..errors import InputError
from .carry import Carrier, is_same_scene
from .manifest import Manifest
from .manifest_file import MANIFEST_NAME
from .presets import DEFAULT_PRESET, Preset
from .store import CacheStore
from .surfaces import Surfaces


@dataclass(frozen=True)
class BakeSettings:
    """What may be chosen about a bake.

    Attributes:
        preset: how fine.
        only: ids of the cameras to bake now; None for all.
        resume: keep finished cameras of an earlier bake of this scene with these settings; where
            the scene changed since, those that see none of what changed.
        overwrite: take the place of a cache of another scene; with `resume` also of one of other
            cameras, of which those that are the same are kept.
        frames: to bake beside the current one, in ascending order.
    """

    preset: Preset = DEFAULT_PRESET
    only: frozenset[int] | None = None
    resume: bool = False
    overwrite: bool = False
    frames: tuple[int, ...] = ()


def cached_preset(cache: Path) -> Preset | None:
    """The preset of an earlier bake into this folder; None without one.

    Raises:
        InputError: there is a cache, but a damaged one or of another version.
    """
    if not (cache / MANIFEST_NAME).exists():
        return None
    return cast("Preset", CacheStore.open(cache).manifest.settings.get("preset"))


def preset_to_bake(cache: Path, asked: Preset | None, *, goes_on: bool, overwrite: bool) -> Preset:
    """How fine a bake into this folder is: as asked, or as the cache was begun that it goes on
    with, or as usual.

    Args:
        cache: the folder.
        asked: None for no wish.
        goes_on: whether an earlier bake is gone on with.
        overwrite: whether one that cannot be read is replaced.

    Raises:
        InputError: as `cached_preset`, if that is not replaced.
    """
    if asked is not None or not goes_on:
        return asked or DEFAULT_PRESET
    try:
        return cached_preset(cache) or DEFAULT_PRESET
    except InputError:
        if overwrite:
            return DEFAULT_PRESET
        raise


def prepare_store(
    folder: Path, manifest: Manifest, settings: BakeSettings, carrier: Carrier | None = None
) -> CacheStore:
    """The cache to bake into: an earlier one, or a new one in its place.

    An earlier cache of the same scene, cameras and settings stays as it is: its files are
    replaced one by one as cameras are baked again, so a bake that fails loses none of them.
    Several processes may do so at once. With `resume`, what is still true of a cache of the
    scene before it changed is carried into the new one.

    Raises:
        InputError: the folder cannot be written, or holds another scene's cache, or one that
            was baked from other cameras or with another preset and is to be gone on with.
    """
    folder = Path(folder)
    with CacheStore.exclusive(folder):
        earlier = earlier_cache(folder, manifest.surfaces, manifest.fingerprint, settings)
        if earlier is None:
            return CacheStore.create(folder, manifest)
        if earlier.manifest.continues(manifest):
            earlier.sweep()
            return earlier
        if settings.resume and (settings.overwrite or _differs_in_scene(earlier, manifest)):
            return CacheStore.create(folder, (carrier or Carrier()).carried(earlier, manifest))
        if settings.overwrite or (not settings.resume and settings.only is None):
            return CacheStore.create(folder, manifest)
        raise InputError(_difference(folder, earlier.manifest, manifest))


def _differs_in_scene(earlier: CacheStore, wanted: Manifest) -> bool:
    """Whether settings and cameras are the same, so that only objects, materials or the world
    may have changed."""
    cameras = [camera.to_json() for camera in wanted.cameras]
    before = [camera.to_json() for camera in earlier.manifest.cameras]
    return dict(earlier.manifest.settings) == dict(wanted.settings) and before == cameras


def earlier_cache(
    folder: Path, surfaces: Surfaces, fingerprint: str, settings: BakeSettings
) -> CacheStore | None:
    """The scene's own cache in this folder; None for none, or for one that is to be replaced.

    With `resume` that may be one of the scene before its objects or materials changed.

    Args:
        folder: the cache's.
        surfaces: the scene's, as they are.
        fingerprint: of these.
        settings: of the bake.

    Raises:
        InputError: a cache of another scene, another version or a damaged one is there, and it
            is not to be overwritten.
    """
    if not (folder / MANIFEST_NAME).exists():
        return None
    try:
        store = CacheStore.open(folder)
    except InputError as error:
        if settings.overwrite:
            return None
        raise InputError(f"{error} (--overwrite replaces it)") from error
    if store.manifest.fingerprint == fingerprint:
        return store
    if settings.resume and is_same_scene(store.manifest.surfaces, surfaces):
        return store
    if settings.overwrite:
        return None
    raise InputError(
        f"{folder} is the cache of another scene, or of this one before its objects or materials "
        "changed; bake with --resume to bake again what sees a change, with --overwrite to replace "
        "all of it, or choose another folder"
    )


def _difference(folder: Path, earlier: Manifest, wanted: Manifest) -> str:
    """Why an earlier bake cannot be gone on with, in one sentence."""
    if earlier.settings != wanted.settings:
        what = f"the preset {earlier.settings.get('preset')!r}"
    elif earlier.plan != wanted.plan:
        what = "other channels, for a world or materials that changed"
    else:
        return (
            f"{folder} was baked with other caching cameras; bake with --resume --overwrite, which "
            "keeps those that are the same, or choose another folder"
        )
    return (
        f"{folder} was baked with {what}; bake all of it again, without --resume and --cameras, "
        "or choose another folder"
    )
