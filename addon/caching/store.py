# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache on disk: a manifest, and one multi-part OpenEXR file for each caching camera.

    <name>.relume/
      manifest.json                  schema version, scene fingerprint, plan, cameras, their files
      cameras/0007-1f2e3d4c.exr      a part for each channel
      frames/0012/0007-5a6b7c8d.exr  the same of another frame, if the camera sees a change there
      world-1f2e3d4c.exr             the world's picture, if it varies with direction

Every file is written under a temporary name, flushed to the disk and renamed; the manifest
comes last. A picture's name ends with the first digits of its SHA-256: a camera that is baked
again does not touch its earlier picture, which goes when the manifest names the new one. So a
reader finds the old state or the new one, never half of either, at whatever moment the writer is
killed. The manifest records each file's size and SHA-256, and its own; nothing is read that
differs.

Processes that bake cameras of one cache put their pictures in place and change its manifest one
at a time, each from what it then says, so that none loses what another one finished.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..whole_file import flush_file, flush_folder, put_in_place, temporary_beside, write_errors
from .cache_names import WORLD_STEM, camera_stem, named
from .file_record import FileRecord
from .folder_lock import locked
from .frame_state import FramePicture, FrameState
from .framebuffer import DeepFramebuffer
from .framebuffer_file import parts_of, write_parts
from .manifest import Manifest
from .manifest_file import read_manifest, write_manifest
from .seen_surfaces import Seen
from .stored_cache import StoredCache
from .sweep import sweep

_ELSEWHERE = "choose another folder"


class CacheStore(StoredCache):
    """One cache folder, which may be changed."""

    @classmethod
    def create(cls, folder: Path, manifest: Manifest) -> Self:
        """Make the folder and write a first manifest; what an earlier cache left there goes.

        Raises:
            InputError: nothing can be written there.
        """
        store = cls(Path(folder), manifest)
        with write_errors(store.folder, _ELSEWHERE):
            (store.folder / "cameras").mkdir(parents=True, exist_ok=True)
            flush_folder(store.folder.absolute().parent)
        store.write_manifest(manifest)
        store.sweep()
        return store

    @staticmethod
    @contextmanager
    def exclusive(folder: Path) -> Iterator[None]:
        """Make the folder, and keep other processes from changing its cache in this block.

        Raises:
            InputError: nothing can be written there.
        """
        with write_errors(folder, _ELSEWHERE):
            folder.mkdir(parents=True, exist_ok=True)
            with locked(folder):
                yield

    def write_camera(self, framebuffer: DeepFramebuffer) -> FileRecord:
        """Write one deep framebuffer; the caller records it in the manifest.

        Raises:
            InputError: the disk is full or the folder cannot be written; nothing is left.
        """
        stem = camera_stem(framebuffer.camera.id)
        with self._written(stem, parts_of(framebuffer)) as (temporary, record):
            put_in_place(temporary, self.folder / named(stem, record))
        return record

    def write_manifest(self, manifest: Manifest) -> None:
        """Replace the manifest. Raises as write_camera()."""
        write_manifest(self.folder, manifest, _ELSEWHERE)
        self.manifest = manifest

    @contextmanager
    def changing(self) -> Iterator[Manifest]:
        """The manifest as it is on the disk now, which no one else changes in this block.

        Raises:
            InputError: as write_camera(), or another bake began in this folder meanwhile.
        """
        with write_errors(self.folder, _ELSEWHERE), locked(self.folder):
            now = read_manifest(self.folder)
            if not (now.continues(self.manifest) or now.has_grown_from(self.manifest)):
                raise InputError(
                    f"another bake took the place of this one in {self.folder}; choose another "
                    "folder for one of them"
                )
            yield now

    def add_camera(self, framebuffer: DeepFramebuffer, seen: Seen | None = None) -> FileRecord:
        """Write one deep framebuffer and record it, and what it shows, in the manifest.

        Raises:
            InputError: as changing(); all is then as it was before.
        """
        number = framebuffer.camera.id
        stem = camera_stem(number)
        written = self._written(stem, parts_of(framebuffer))
        with written as (temporary, record), self.changing() as now:
            put_in_place(temporary, self.folder / named(stem, record))
            shown = {n: shows for n, shows in now.seen.items() if n != number}
            shown |= {} if seen is None else {number: seen}
            finished = {**now.finished, number: record}
            self.write_manifest(replace(now, finished=finished, seen=shown))
            earlier = now.finished.get(number)
            held = {state.held.get(number) for state in now.frames.values()}
            if earlier is not None and named(stem, earlier) not in held:
                self._remove_earlier(stem, earlier, record)
        return record

    def set_frame(self, frame: int, state: FrameState) -> None:
        """Record what is held of a frame; what is held already of the same state stays.

        Raises:
            InputError: as changing().
        """
        with self.changing() as now:
            known = now.frames.get(frame)
            if known is not None and known.fingerprint == state.fingerprint:
                state = replace(
                    state,
                    held={**known.held, **state.held} if known.plan == state.plan else state.held,
                    world=known.world,
                    world_fingerprint=known.world_fingerprint,
                )
            if state != known:
                frames = {**now.frames, frame: state}
                held = {name for each in frames.values() for name in each.held.values()}
                pictures = {name: p for name, p in now.pictures.items() if name in held}
                self.write_manifest(replace(now, frames=frames, pictures=pictures))
            else:
                self.manifest = now

    def add_frame_camera(
        self, frame: int, framebuffer: DeepFramebuffer, seen: Seen | None = None
    ) -> FileRecord:
        """Write a deep framebuffer of a frame that `set_frame` began, and record it.

        Raises:
            InputError: as changing(); all is then as it was before.
        """
        number = framebuffer.camera.id
        stem = camera_stem(number, frame)
        written = self._written(stem, parts_of(framebuffer))
        with written as (temporary, record), self.changing() as now:
            name = named(stem, record)
            put_in_place(temporary, self.folder / name)
            state = now.frames[frame]
            state = replace(state, held={**state.held, number: name})
            frames = {**now.frames, frame: state}
            pictures = {**now.pictures, name: FramePicture(record, seen)}
            self.write_manifest(replace(now, frames=frames, pictures=pictures))
        return record

    def add_world(self, picture: NDArray[np.float32], fingerprint: str) -> FileRecord:
        """Write the world's picture and record it in the manifest. Raises as add_camera()."""
        written = self._written(WORLD_STEM, {"world": picture})
        with written as (temporary, record), self.changing() as now:
            put_in_place(temporary, self.folder / named(WORLD_STEM, record))
            self.write_manifest(replace(now, world=record, world_fingerprint=fingerprint))
            if now.world is not None:
                self._remove_earlier(WORLD_STEM, now.world, record)
        return record

    def add_frame_world(
        self, frame: int, picture: NDArray[np.float32], fingerprint: str
    ) -> FileRecord:
        """Write the world's picture at a frame that `set_frame` began, and record it. Raises as
        add_camera()."""
        written = self._written(WORLD_STEM, {"world": picture})
        with written as (temporary, record), self.changing() as now:
            put_in_place(temporary, self.folder / named(WORLD_STEM, record))
            state = replace(now.frames[frame], world=record, world_fingerprint=fingerprint)
            self.write_manifest(replace(now, frames={**now.frames, frame: state}))
        return record

    def sweep(self) -> None:
        """Remove pictures that the manifest does not name, and what a killed process left.

        To be called where no other process changes the cache.
        """
        manifest = self.manifest
        names = {self.camera_path(n).relative_to(self.folder).as_posix() for n in manifest.finished}
        worlds = [manifest.world, *(state.world for state in manifest.frames.values())]
        names |= {named(WORLD_STEM, record) for record in worlds if record is not None}
        names |= {name for state in manifest.frames.values() for name in state.held.values()}
        sweep(self.folder, names)

    def _remove_earlier(self, stem: str, earlier: FileRecord, record: FileRecord) -> None:
        if named(stem, earlier) != named(stem, record):
            # What is open elsewhere cannot be removed on Windows; the next bake sweeps it.
            with suppress(OSError):
                (self.folder / named(stem, earlier)).unlink()

    @contextmanager
    def _written(
        self, stem: str, parts: Mapping[str, NDArray[Any]]
    ) -> Iterator[tuple[Path, FileRecord]]:
        """A temporary file with these parts, on the disk, which the block puts in its place."""
        path = self.folder / f"{stem}.exr"
        with temporary_beside(path, _ELSEWHERE) as temporary:
            if self.folder.is_dir() and not path.parent.is_dir():
                path.parent.mkdir(parents=True, exist_ok=True)
                flush_folder(path.parent.parent)
            write_parts(temporary, parts)
            record = FileRecord.of(temporary)
            flush_file(temporary)
            yield temporary, record
