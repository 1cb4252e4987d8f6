# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the holes of views on the command line: what the relight and evaluate verbs share."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from addon.caching.store import CacheStore
from addon.caching.temporary_store import TemporaryStore
from addon.camplace.hole_cameras import hole_cameras
from addon.progress import Progress
from addon.scene.view import View

from .cache_check import check_cache
from .relit import SceneArrays

if TYPE_CHECKING:
    from addon.relight.session import RelightSession


class Filling:
    """Bakes what a cache does not show of views, and has a session show it.

    At the end of a `with` block the pictures become part of the cache or go, whatever ended it.

    Args:
        scene: the open `bpy.types.Scene`, at the frame at which `arrays` were read.
        arrays: what was read of it.
        cache: the cache's folder.
        session: that shows it.
        fills: whether anything is done at all.
        sharpens: whether what the cache shows too coarsely is baked too.
        keeps: whether the pictures become part of the cache at the end; else they go.
    """

    def __init__(
        self,
        scene: Any,
        arrays: SceneArrays,
        cache: Path,
        session: RelightSession,
        *,
        fills: bool,
        keeps: bool,
        sharpens: bool = False,
    ) -> None:
        self._scene = scene
        self._arrays = arrays
        self._cache = cache
        self._session = session
        self._fills = fills
        self._keeps = keeps
        self._sharpens = sharpens
        self._numbers: list[int] = []
        self._resolutions: list[int] = []
        self._notes: list[str] = []
        self._seconds = 0.0

    def fill(self, view: View, progress: Progress) -> None:
        """Fill the holes of a view, and leave the session at it.

        Raises:
            InputError: the cache is not of the scene as it is, or cannot be written.
            Cancelled: raised by `progress`; no picture is left.
        """
        if not self._fills:
            return
        from addon.hole_bake import bake_holes

        started = time.monotonic()
        self._session.set_view(view)
        points = self._session.hole_points(and_soft=self._sharpens)
        found = hole_cameras(view, points)
        if not found.cameras:
            return
        if found.note:
            self._notes.append(f"camera '{view.name}': {found.note}")
        try:
            self._numbers += bake_holes(
                self._scene,
                self._arrays.geometry,
                CacheStore.open(self._cache),
                found.cameras,
                progress,
                together=self._numbers,
            )
        except BaseException:
            self._temporary.discard(self._numbers)
            raise
        pictures = [f for f in self._temporary.read() if f.camera.id in {*self._numbers}]
        self._session.set_added(pictures)
        self._resolutions += [camera.resolution for camera in found.cameras]
        self._seconds += time.monotonic() - started

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Keep the pictures in the cache, or remove them."""
        if not self._numbers:
            return
        if self._keeps:
            self._temporary.keep(self._numbers)
        else:
            self._temporary.discard(self._numbers)

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence for each view that is left with something that it lacks."""
        return tuple(self._notes)

    @property
    def _temporary(self) -> TemporaryStore:
        return TemporaryStore(check_cache(self._arrays.geometry, self._cache, self._arrays.frame))

    def report(self) -> dict[str, Any]:
        """Plain values for the verb's result."""
        return {
            "cameras": len(self._resolutions),
            "resolutions": self._resolutions,
            "kept": self._keeps and bool(self._numbers),
            "seconds": round(self._seconds, 3),
        }
