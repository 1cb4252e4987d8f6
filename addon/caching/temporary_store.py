# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures beside a cache: of caching cameras that stand at a view for its holes.

    <name>.relume/
      temporary/0123456789abcdef/  a cache of its own, for each state of the scene that has any:
        manifest.json              named after the state's fingerprint
        cameras/0000-1f2e3d4c.exr

The cache's own manifest does not know of them, so that nothing has to be read again when they come
and go. Several processes may add some at once, as in any cache.
"""

from __future__ import annotations

import shutil
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..whole_file import put_in_place
from .frame_state import FramePicture
from .framebuffer import DeepFramebuffer
from .manifest import Manifest
from .manifest_file import MANIFEST_NAME
from .store import CacheStore

FOLDER_NAME = "temporary"

# What they may take: the oldest give way to new ones, but for those that are baked together with
# these; `hole_cameras` bounds what one view has. Each makes the search of every pixel longer.
MOST_PICTURES = 24
MOST_BYTES = 256 << 20

_NAME_DIGITS = 16


class TemporaryStore:
    """The temporary pictures beside a cache, of one state of its scene.

    Attributes:
        folder: where they lie.
    """

    def __init__(self, store: CacheStore) -> None:
        """`store` is the cache as it is at that state; see `CacheStore.showing`."""
        self._store = store
        self._all = store.folder / FOLDER_NAME
        self.folder = self._all / store.manifest.fingerprint[:_NAME_DIGITS]

    @property
    def cameras(self) -> tuple[CachingCamera, ...]:
        """Whose pictures there are, the oldest first; their numbers are their own."""
        begun = self._begun()
        return () if begun is None else begun.cameras

    @property
    def bytes(self) -> int:
        """What the pictures take on disk."""
        begun = self._begun()
        return 0 if begun is None else _bytes(begun)

    def read(self) -> tuple[DeepFramebuffer, ...]:
        """All of them, the oldest first. One that is damaged or gone is left out: it can be
        baked again whenever it is needed."""
        begun = self._begun()
        found = []
        for camera in () if begun is None else begun.cameras:
            with suppress(InputError):
                assert begun is not None
                found.append(begun.read_camera(camera.id))
        return tuple(found)

    def add(self, framebuffer: DeepFramebuffer, together: Collection[int] = ()) -> int:
        """Write a picture; returns its number here, whatever number its camera had.

        Args:
            framebuffer: the picture.
            together: numbers of those that are there for the same purpose, and do not give way to
                it however many they are.

        Raises:
            InputError: the disk is full or the folder cannot be written; all is as before.
        """
        with CacheStore.exclusive(self.folder):
            begun = self._begun() or CacheStore.create(self.folder, self._beginning())
            manifest = begun.manifest
            number = 1 + max((camera.id for camera in manifest.cameras), default=-1)
            camera = replace(framebuffer.camera, id=number)
            record = begun.write_camera(
                DeepFramebuffer(camera, framebuffer.channels, framebuffer.wide, framebuffer.behind)
            )
            begun.write_manifest(
                replace(
                    manifest,
                    cameras=(*manifest.cameras, camera),
                    finished={**manifest.finished, number: record},
                )
            )
            self._drop(begun, self._oldest(begun, {*together, number}))
        self._sweep()
        return number

    def discard(self, numbers: Collection[int] | None = None) -> None:
        """Remove pictures; all of this state without `numbers`. Raises InputError as `add`."""
        if not self.folder.exists():
            return
        with CacheStore.exclusive(self.folder):
            begun = self._begun()
            if begun is not None:
                known = [camera.id for camera in begun.manifest.cameras]
                self._drop(begun, known if numbers is None else [n for n in known if n in numbers])
            if begun is None or not begun.manifest.cameras:
                self._remove()

    def keep(
        self, numbers: Collection[int] | None = None, *, taken: Collection[int] = ()
    ) -> tuple[CachingCamera, ...]:
        """Make pictures part of the cache, and return their cameras there.

        Args:
            numbers: which; None for all.
            taken: numbers that their cameras must not get, beside those of the cache: of cameras
                that are placed and not baked yet.

        Raises:
            InputError: the cache cannot be written, or another bake took its place.
        """
        if not self.folder.exists():
            return ()
        kept = []
        with CacheStore.exclusive(self.folder):
            begun = self._begun()
            for camera in () if begun is None else begun.cameras:
                if begun is not None and (numbers is None or camera.id in numbers):
                    kept.append(self._kept(begun, camera, taken))
                    self._drop(begun, [camera.id])
            if begun is None or not begun.manifest.cameras:
                self._remove()
        return tuple(kept)

    def _remove(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        with suppress(OSError):  # pictures of other states are there
            self._all.rmdir()

    def _kept(
        self, begun: CacheStore, camera: CachingCamera, taken: Collection[int]
    ) -> CachingCamera:
        """Move a picture into the cache, behind all that it has."""
        source, record = begun.camera_path(camera.id), begun.manifest.finished[camera.id]
        cache = CacheStore.open(self._store.folder)
        with cache.changing() as now:
            fingerprint = begun.manifest.fingerprint
            number = 1 + max([*(c.id for c in now.cameras), *taken], default=-1)
            frames = [n for n, state in now.frames.items() if state.fingerprint == fingerprint]
            is_first = fingerprint == now.fingerprint
            if not is_first and not frames:
                raise InputError(
                    f"{cache.folder} holds the scene no longer as it was when these pictures were "
                    "baked; discard them"
                )
            path = cache.picture_path(number, record, None if is_first else frames[0])
            path.parent.mkdir(parents=True, exist_ok=True)
            put_in_place(source, path)
            camera = replace(camera, id=number, source=number)
            with_it = replace(now, cameras=(*now.cameras, camera))
            if is_first:
                with_it = replace(with_it, finished={**now.finished, number: record})
            else:
                name = path.relative_to(cache.folder).as_posix()
                state = now.frames[frames[0]]
                state = replace(state, held={**state.held, number: name})
                with_it = replace(
                    with_it,
                    frames={**now.frames, frames[0]: state},
                    pictures={**now.pictures, name: FramePicture(record, None)},
                )
            cache.write_manifest(with_it)
        return camera

    def _begun(self) -> CacheStore | None:
        """What is there, if it is of the same channels."""
        if not (self.folder / MANIFEST_NAME).exists():
            return None
        try:
            begun = CacheStore.open(self.folder)
        except InputError:  # nothing that could not be baked again
            return None
        mine, theirs = self._store.manifest, begun.manifest
        same = (mine.fingerprint, mine.plan) == (theirs.fingerprint, theirs.plan)
        return begun if same else None

    def _beginning(self) -> Manifest:
        cache = self._store.manifest
        return Manifest(cache.fingerprint, cache.settings, cache.plan, (), frame=cache.frame)

    @staticmethod
    def _oldest(begun: CacheStore, together: Collection[int]) -> list[int]:
        """Those that have to go, so that there are no more than there may be; not these."""
        manifest = begun.manifest
        count, size = len(manifest.cameras), _bytes(begun)
        gone: list[int] = []
        for camera in manifest.cameras:
            if count - len(gone) <= MOST_PICTURES and size <= MOST_BYTES:
                break
            if camera.id not in together:
                gone.append(camera.id)
                size -= manifest.finished[camera.id].size
        return gone

    @staticmethod
    def _drop(begun: CacheStore, numbers: Sequence[int]) -> None:
        if not numbers:
            return
        manifest = begun.manifest
        paths = [begun.camera_path(n) for n in numbers if n in manifest.finished]
        begun.write_manifest(
            replace(
                manifest,
                cameras=tuple(c for c in manifest.cameras if c.id not in numbers),
                finished={n: r for n, r in manifest.finished.items() if n not in numbers},
            )
        )
        for path in paths:
            # What is open elsewhere cannot be removed on Windows; it goes with its folder.
            with suppress(OSError):
                path.unlink(missing_ok=True)

    def _sweep(self) -> None:
        """Remove what is of states of the scene that the cache does not hold any more."""
        with suppress(InputError):
            now = CacheStore.open(self._store.folder).manifest
            states = [now.fingerprint, *(state.fingerprint for state in now.frames.values())]
            names = {self.folder.name, *(state[:_NAME_DIGITS] for state in states)}
            for other in self._all.iterdir():
                if other.is_dir() and other.name not in names:
                    shutil.rmtree(other, ignore_errors=True)


def temporary_stores(cache: CacheStore) -> tuple[TemporaryStore, ...]:
    """What there is beside a cache, of each state of the scene that the cache holds."""
    states = [cache, *(cache.at_frame(frame) for frame in cache.manifest.frames)]
    found = {store.folder: store for store in map(TemporaryStore, states)}
    return tuple(store for store in found.values() if store.folder.exists())


def temporary_pictures(cache: Path) -> tuple[int, int]:
    """How many there are beside the cache in this folder, and their bytes: a quick look."""
    sizes = []
    for path in (cache / FOLDER_NAME).glob("*/cameras/[0-9]*.exr"):
        with suppress(OSError):  # it is just going
            sizes.append(path.stat().st_size)
    return len(sizes), sum(sizes)


def discard_all(cache: Path) -> None:
    """Remove all temporary pictures beside the cache in this folder, of whatever state."""
    shutil.rmtree(cache / FOLDER_NAME, ignore_errors=True)


def _bytes(begun: CacheStore) -> int:
    return sum(record.size for record in begun.manifest.finished.values())
