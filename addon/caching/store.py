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

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..native_lines import without_lines
from ..scene.octahedral import from_words, to_words
from ..whole_file import (
    flush_file,
    flush_folder,
    put_in_place,
    replacing,
    temporary_beside,
    write_errors,
)
from .channels import CHANNEL_BY_NAME
from .file_record import FileRecord
from .folder_lock import LOCK_NAME, locked
from .frame_state import FramePicture, FrameState, frame_ranges
from .framebuffer import DeepFramebuffer
from .manifest_seal import is_sealed, sealed
from .plan import ChannelPlan
from .seen_surfaces import Seen
from .surfaces import Surfaces

SCHEMA = "relume-cache"
SCHEMA_VERSION = 2
MANIFEST_NAME = "manifest.json"
WORLD_STEM = "world"
_BAKE_AGAIN = "bake the cache again"
_ELSEWHERE = "choose another folder"

# OpenEXR's wheel exports its C functions. In a Blender that loads its own, older OpenEXR as a
# shared library, that one's take their place, and the wheel's settings for kinds of compression
# that are newer than it find no part to apply to: two lines for each part, none of which is
# compressed so. No wheel for Python 3.14 is as old as Blender's library.
_HARMLESS = b"<compression>: (EXR_ERR_ARGUMENT_OUT_OF_RANGE) Part index (0) out of range"

# Writing one file takes seconds; a temporary file older than this has no writer any more.
_PART_SECONDS = 3600.0


@dataclass(frozen=True)
class Manifest:
    """The state of a cache.

    Attributes:
        fingerprint: of the scene that it was baked from.
        settings: of the bake, as plain values; cameras baked with others are not mixed in.
        plan: the channels.
        cameras: all caching cameras, finished or not, in order.
        finished: the files of the finished ones, by camera id.
        world: the world's picture, if there is one.
        world_fingerprint: of the world that the picture shows; "" without one.
        surfaces: the states of the objects and materials that `fingerprint` is of.
        cut_out: names of the materials that light passes through somewhere.
        seen: what the finished cameras' pictures show, by camera id, where that is known.
        frame: the scene's frame when it was baked.
        frames: what is held of other frames.
        pictures: the files that only those have, by their path within the cache's folder.
    """

    fingerprint: str
    settings: Mapping[str, Any]
    plan: ChannelPlan
    cameras: tuple[CachingCamera, ...]
    finished: Mapping[int, FileRecord] = field(default_factory=dict)
    world: FileRecord | None = None
    world_fingerprint: str = ""
    surfaces: Surfaces = field(default_factory=Surfaces)
    cut_out: tuple[str, ...] = ()
    seen: Mapping[int, Seen] = field(default_factory=dict)
    frame: int = 1
    frames: Mapping[int, FrameState] = field(default_factory=dict)
    pictures: Mapping[str, FramePicture] = field(default_factory=dict)

    def continues(self, other: Manifest) -> bool:
        """Whether it and `other` are states of one bake: all but what is finished is equal.

        The fingerprint stands for the surfaces; at which frame they were so does not matter.
        """
        mine, theirs = self._begun(), other._begun()
        return mine == theirs

    def has_grown_from(self, other: Manifest) -> bool:
        """Whether it is a state of the same bake after cameras were added to it."""
        first = replace(self, cameras=self.cameras[: len(other.cameras)])
        return len(self.cameras) > len(other.cameras) and first.continues(other)

    def _begun(self) -> tuple[Any, ...]:
        cameras = [camera.to_json() for camera in self.cameras]
        return self.fingerprint, dict(self.settings), self.plan.to_json(), cameras

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "schema": SCHEMA,
            "version": SCHEMA_VERSION,
            "fingerprint": self.fingerprint,
            "settings": dict(self.settings),
            "plan": self.plan.to_json(),
            "cameras": [camera.to_json() for camera in self.cameras],
            "finished": {str(number): vars(record) for number, record in self.finished.items()},
            "world": None if self.world is None else vars(self.world),
            "world_fingerprint": self.world_fingerprint,
            "surfaces": self.surfaces.to_json(),
            "cut_out": list(self.cut_out),
            "seen": {str(number): seen.to_json() for number, seen in self.seen.items()},
            "frame": self.frame,
            "frames": {str(number): state.to_json() for number, state in self.frames.items()},
            "pictures": {name: picture.to_json() for name, picture in self.pictures.items()},
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Manifest:
        """Raises KeyError, TypeError or ValueError on anything that to_json() did not write."""
        return cls(
            fingerprint=str(data["fingerprint"]),
            settings=dict(data["settings"]),
            plan=ChannelPlan.from_json(data["plan"]),
            cameras=tuple(CachingCamera.from_json(camera) for camera in data["cameras"]),
            finished={int(n): FileRecord.from_json(r) for n, r in data["finished"].items()},
            world=None if data["world"] is None else FileRecord.from_json(data["world"]),
            world_fingerprint=str(data.get("world_fingerprint", "")),
            surfaces=Surfaces.from_json(data["surfaces"]),
            cut_out=tuple(str(name) for name in data["cut_out"]),
            seen={int(n): Seen.from_json(seen) for n, seen in data["seen"].items()},
            frame=int(data["frame"]),
            frames={int(n): FrameState.from_json(state) for n, state in data["frames"].items()},
            pictures={
                str(name): FramePicture.from_json(picture)
                for name, picture in data["pictures"].items()
            },
        )


class CacheStore:
    """One cache folder.

    Attributes:
        folder: where it is.
        manifest: its state, as last read or written.
    """

    def __init__(
        self, folder: Path, manifest: Manifest, places: Mapping[int, str] | None = None
    ) -> None:
        """`places` are paths within the folder, by camera id, of files that lie elsewhere than
        `camera_path` would look for them."""
        self.folder = folder
        self.manifest = manifest
        self._places = places or {}

    @classmethod
    def open(cls, folder: Path) -> CacheStore:
        """Open an existing cache.

        Raises:
            InputError: there is none, or it is of another version, damaged or unreadable.
        """
        folder = Path(folder)
        path = folder / MANIFEST_NAME
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
        except (FileNotFoundError, NotADirectoryError) as error:
            raise InputError(f"{folder} holds no Relume cache; bake one there first") from error
        except OSError as error:
            raise _unreadable(path, error) from error
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path} is damaged ({error}); {_BAKE_AGAIN}") from error
        if not isinstance(data, dict) or data.get("schema") != SCHEMA:
            raise InputError(f"{path} is not a Relume cache's manifest; choose another folder")
        version = data.get("version")
        if version != SCHEMA_VERSION:
            newer = isinstance(version, int) and version > SCHEMA_VERSION
            remedy = "update Relume" if newer else _BAKE_AGAIN
            raise InputError(
                f"{folder} is a cache of version {version!r}, and this Relume reads version "
                f"{SCHEMA_VERSION}; {remedy}"
            )
        if not is_sealed(data):
            raise InputError(
                f"{path} is damaged: it was changed after it was written; {_BAKE_AGAIN}"
            )
        try:
            return cls(folder, Manifest.from_json(data))
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise InputError(f"{path} is damaged ({error!r}); {_BAKE_AGAIN}") from error

    @classmethod
    def create(cls, folder: Path, manifest: Manifest) -> CacheStore:
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

    @property
    def plan(self) -> ChannelPlan:
        """The channels."""
        return self.manifest.plan

    @property
    def cameras(self) -> tuple[CachingCamera, ...]:
        """The finished cameras."""
        finished = self.manifest.finished
        return tuple(camera for camera in self.manifest.cameras if camera.id in finished)

    def check_fingerprint(self, fingerprint: str) -> None:
        """Raises InputError when the cache belongs to another or a changed scene."""
        if self.manifest.fingerprint != fingerprint:
            raise self._stale()

    def _stale(self) -> InputError:
        return InputError(
            f"{self.folder} is the cache of another scene, or of this one before its objects or "
            "materials changed; bake it again or choose another folder"
        )

    def showing(self, fingerprint: str, frame: int) -> CacheStore:
        """The cache as it is at the frame at which the scene is: for reading only.

        Args:
            fingerprint: of the scene as it is.
            frame: at which it is so.

        Raises:
            InputError: nothing in the cache was baked from a scene that was like this.
        """
        manifest = self.manifest
        found = self.matching(fingerprint, frame)
        if found is not None:
            return found
        if manifest.frames and frame not in manifest.frames and frame != manifest.frame:
            baked = frame_ranges((manifest.frame, *manifest.frames))
            raise InputError(
                f"{self.folder} does not hold frame {frame}, in which other objects or materials "
                f"are seen; it holds the frames {baked}; bake it with --resume --frames {frame}"
            )
        raise self._stale()

    def matching(self, fingerprint: str, frame: int) -> CacheStore | None:
        """As `showing`, but None where that raises."""
        manifest = self.manifest
        if fingerprint == manifest.fingerprint:
            return self
        # Another frame that is alike may have another world.
        for number in sorted(manifest.frames, key=lambda number: number != frame):
            if manifest.frames[number].fingerprint == fingerprint:
                return self.at_frame(number)
        return None

    def at_frame(self, frame: int) -> CacheStore:
        """The cache as it is at a frame that it holds beside its first: for reading only.

        Raises:
            InputError: it does not hold that frame.
        """
        manifest = self.manifest
        state = manifest.frames.get(frame)
        if state is None:
            baked = frame_ranges((manifest.frame, *manifest.frames))
            raise InputError(f"{self.folder} does not hold frame {frame}, but {baked}")
        finished: dict[int, FileRecord] = {}
        seen: dict[int, Seen] = {}
        for number, name in state.held.items():
            picture = self._picture(number, name)
            if picture is not None:
                finished[number] = picture.record
                if picture.seen is not None:
                    seen[number] = picture.seen
        own_world = state.world is not None
        at_frame = replace(
            manifest,
            fingerprint=state.fingerprint,
            plan=state.plan or manifest.plan,
            finished=finished,
            seen=seen,
            world=state.world if own_world else manifest.world,
            world_fingerprint=state.world_fingerprint if own_world else manifest.world_fingerprint,
        )
        return CacheStore(self.folder, at_frame, state.held)

    def _picture(self, number: int, name: str) -> FramePicture | None:
        """What is known of a file that a frame names for a camera; None if it is gone."""
        record = self.manifest.finished.get(number)
        if record is not None and self.first_name(number) == name:
            return FramePicture(record, self.manifest.seen.get(number))
        return self.manifest.pictures.get(name)

    def first_name(self, number: int) -> str:
        """The path within the folder of a camera's picture of the cache's first frame."""
        record = self.manifest.finished[number]
        return self._name(_path(self._camera_stem(number), record))

    def _name(self, path: Path) -> str:
        return path.relative_to(self.folder).as_posix()

    def camera_path(self, number: int) -> Path:
        """The file of a finished camera. Raises KeyError for another one."""
        if number in self._places:
            return self.folder / self._places[number]
        return _path(self._camera_stem(number), self.manifest.finished[number])

    def picture_path(self, number: int, record: FileRecord, frame: int | None = None) -> Path:
        """Where a picture of a camera belongs, of the first frame or of another one."""
        return _path(self._camera_stem(number, frame), record)

    @property
    def world_path(self) -> Path | None:
        """The file of the world's picture, if there is one."""
        record = self.manifest.world
        return None if record is None else _path(self.folder / WORLD_STEM, record)

    def is_intact(self, number: int) -> bool:
        """Whether a camera's file is there and is what was written."""
        record = self.manifest.finished.get(number)
        return record is not None and _is_intact(self.camera_path(number), record)

    def has_world(self, fingerprint: str) -> bool:
        """Whether the picture of the world with this fingerprint is there, as it was written."""
        manifest = self.manifest
        if manifest.world is None or manifest.world_fingerprint != fingerprint:
            return False
        return _is_intact(_path(self.folder / WORLD_STEM, manifest.world), manifest.world)

    def read_camera(self, number: int) -> DeepFramebuffer:
        """One deep framebuffer.

        Raises:
            InputError: its file is missing, damaged, or not the one that was baked.
        """
        camera = next((c for c in self.manifest.cameras if c.id == number), None)
        if camera is None or number not in self.manifest.finished:
            raise InputError(f"{self.folder} has no finished camera {number}; bake it")
        path = self.camera_path(number)
        _check(path, self.manifest.finished[number])
        parts = _read_parts(path)
        channels, wide = {}, set()
        for name in self.plan.stored:
            is_direction = CHANNEL_BY_NAME[name].is_direction
            components = 1 if is_direction else self.plan.components(name)
            shape = (camera.resolution, camera.resolution, components)
            pixels = parts.get(name)
            if (
                pixels is None
                or pixels.shape != shape
                or (pixels.dtype == np.uint32) != is_direction
            ):
                raise InputError(f"{path} lacks the channel {name}; {_BAKE_AGAIN}")
            if is_direction:
                channels[name] = from_words(pixels)
                continue
            if CHANNEL_BY_NAME[name].precision == "half" and pixels.dtype != np.float16:
                wide.add(name)
            channels[name] = pixels.astype(np.float32, copy=False)
        if "depth" in channels:
            nothing = channels["depth"] == 0.0
            for name, values in channels.items():
                if CHANNEL_BY_NAME[name].is_direction:
                    np.copyto(values, np.float32(0.0), where=nothing)
        return DeepFramebuffer(camera, channels, frozenset(wide))

    def read_finished(self) -> list[DeepFramebuffer]:
        """All finished deep framebuffers, in the cameras' order. Raises as read_camera()."""
        return [self.read_camera(camera.id) for camera in self.cameras]

    def read_world(self, fingerprint: str) -> NDArray[np.float32]:
        """The picture of the world with this fingerprint, (H, W, 3) float32, row 0 straight down.

        Raises:
            InputError: the cache has none, or one of another world, or it is damaged.
        """
        if self.manifest.world is None:
            raise InputError(
                f"{self.folder} has no picture of the world, which varies with direction; "
                f"{_BAKE_AGAIN}"
            )
        if self.manifest.world_fingerprint != fingerprint:
            raise InputError(
                f"the world changed after {self.folder} was baked; bake it again with --resume"
            )
        path = _path(self.folder / WORLD_STEM, self.manifest.world)
        _check(path, self.manifest.world)
        return _read_parts(path)["world"].astype(np.float32, copy=False)

    def write_camera(self, framebuffer: DeepFramebuffer) -> FileRecord:
        """Write one deep framebuffer; the caller records it in the manifest.

        Raises:
            InputError: the disk is full or the folder cannot be written; nothing is left.
        """
        stem = self._camera_stem(framebuffer.camera.id)
        with self._written(stem, _parts_of(framebuffer)) as (temporary, record):
            put_in_place(temporary, _path(stem, record))
        return record

    def write_manifest(self, manifest: Manifest) -> None:
        """Replace the manifest. Raises as write_camera()."""
        text = json.dumps(sealed(manifest.to_json()), indent=1) + "\n"
        with replacing(self.folder / MANIFEST_NAME, _ELSEWHERE) as temporary:
            temporary.write_text(text, encoding="utf-8")
        self.manifest = manifest

    @contextmanager
    def changing(self) -> Iterator[Manifest]:
        """The manifest as it is on the disk now, which no one else changes in this block.

        Raises:
            InputError: as write_camera(), or another bake began in this folder meanwhile.
        """
        with write_errors(self.folder, _ELSEWHERE), locked(self.folder):
            now = CacheStore.open(self.folder).manifest
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
        stem = self._camera_stem(number)
        written = self._written(stem, _parts_of(framebuffer))
        with written as (temporary, record), self.changing() as now:
            put_in_place(temporary, _path(stem, record))
            shown = {n: shows for n, shows in now.seen.items() if n != number}
            shown |= {} if seen is None else {number: seen}
            finished = {**now.finished, number: record}
            self.write_manifest(replace(now, finished=finished, seen=shown))
            earlier = now.finished.get(number)
            held = {state.held.get(number) for state in now.frames.values()}
            if earlier is not None and self._name(_path(stem, earlier)) not in held:
                _remove_earlier(stem, earlier, record)
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
                named = {name for each in frames.values() for name in each.held.values()}
                pictures = {name: p for name, p in now.pictures.items() if name in named}
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
        stem = self._camera_stem(number, frame)
        written = self._written(stem, _parts_of(framebuffer))
        with written as (temporary, record), self.changing() as now:
            path = _path(stem, record)
            put_in_place(temporary, path)
            state = now.frames[frame]
            state = replace(state, held={**state.held, number: self._name(path)})
            frames = {**now.frames, frame: state}
            pictures = {**now.pictures, self._name(path): FramePicture(record, seen)}
            self.write_manifest(replace(now, frames=frames, pictures=pictures))
        return record

    def add_world(self, picture: NDArray[np.float32], fingerprint: str) -> FileRecord:
        """Write the world's picture and record it in the manifest. Raises as add_camera()."""
        stem = self.folder / WORLD_STEM
        written = self._written(stem, {"world": picture})
        with written as (temporary, record), self.changing() as now:
            put_in_place(temporary, _path(stem, record))
            self.write_manifest(replace(now, world=record, world_fingerprint=fingerprint))
            _remove_earlier(stem, now.world, record)
        return record

    def add_frame_world(
        self, frame: int, picture: NDArray[np.float32], fingerprint: str
    ) -> FileRecord:
        """Write the world's picture at a frame that `set_frame` began, and record it. Raises as
        add_camera()."""
        stem = self.folder / WORLD_STEM
        written = self._written(stem, {"world": picture})
        with written as (temporary, record), self.changing() as now:
            put_in_place(temporary, _path(stem, record))
            state = replace(now.frames[frame], world=record, world_fingerprint=fingerprint)
            self.write_manifest(replace(now, frames={**now.frames, frame: state}))
        return record

    def sweep(self) -> None:
        """Remove pictures that the manifest does not name, and what a killed process left.

        To be called where no other process changes the cache.
        """
        keep = {self.camera_path(number) for number in self.manifest.finished} | {self.world_path}
        for state in self.manifest.frames.values():
            keep |= {self.folder / name for name in state.held.values()}
            if state.world is not None:
                keep.add(_path(self.folder / WORLD_STEM, state.world))
        pictures = (
            (self.folder / "cameras").glob("*.exr"),
            (self.folder / "frames").glob("*/*.exr"),
            self.folder.glob(f"{WORLD_STEM}*.exr"),
        )
        stale = [path for path in chain(*pictures) if path not in keep]
        # By the clock that the files' own times are of, which may be another computer's.
        lock = self.folder / LOCK_NAME
        lock.touch()
        before = lock.stat().st_mtime - _PART_SECONDS
        stale += [path for path in self.folder.rglob(".*.part") if _is_older(path, before)]
        for path in stale:
            path.unlink(missing_ok=True)

    def _camera_stem(self, number: int, frame: int | None = None) -> Path:
        """Where a camera's picture lies, of the cache's first frame or of another one."""
        place = self.folder / "cameras"
        if frame is not None:
            place = self.folder / "frames" / f"{frame:04d}"
        return place / f"{number:04d}"

    @contextmanager
    def _written(
        self, stem: Path, parts: Mapping[str, NDArray[Any]]
    ) -> Iterator[tuple[Path, FileRecord]]:
        """A temporary file with these parts, on the disk, which the block puts in its place."""
        with temporary_beside(stem.with_suffix(".exr"), _ELSEWHERE) as temporary:
            if self.folder.is_dir() and not stem.parent.is_dir():
                stem.parent.mkdir(parents=True, exist_ok=True)
                flush_folder(stem.parent.parent)
            _write_parts(temporary, parts)
            record = _file_record(temporary)
            flush_file(temporary)
            yield temporary, record


def _parts_of(framebuffer: DeepFramebuffer) -> dict[str, NDArray[Any]]:
    parts: dict[str, NDArray[Any]] = {}
    for name, pixels in framebuffer.channels.items():
        if CHANNEL_BY_NAME[name].is_direction:
            parts[name] = to_words(pixels)
        else:
            is_half = framebuffer.precision(name) == "half"
            parts[name] = pixels.astype(np.float16) if is_half else pixels
    return parts


def _path(stem: Path, record: FileRecord) -> Path:
    return stem.with_name(f"{stem.name}-{record.sha256[:8]}.exr")


def _remove_earlier(stem: Path, earlier: FileRecord | None, record: FileRecord) -> None:
    if earlier is not None and _path(stem, earlier) != _path(stem, record):
        # What is open elsewhere cannot be removed on Windows; the next bake sweeps it.
        with suppress(OSError):
            _path(stem, earlier).unlink()


def _is_older(path: Path, moment: float) -> bool:
    """Whether a file was last changed before; not if another process has just renamed it."""
    try:
        return path.stat().st_mtime < moment
    except FileNotFoundError:
        return False


def _is_intact(path: Path, record: FileRecord) -> bool:
    try:
        return _file_record(path) == record
    except OSError:
        return False


def _unreadable(path: Path, error: OSError) -> InputError:
    return InputError(f"{path} cannot be read: {error.strerror or error}; {_BAKE_AGAIN}")


def _check(path: Path, record: FileRecord) -> None:
    try:
        found = _file_record(path)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise InputError(f"{path} is missing; {_BAKE_AGAIN}") from error
    except OSError as error:
        raise _unreadable(path, error) from error
    if found != record:
        raise InputError(f"{path} is damaged or not the file that was baked; {_BAKE_AGAIN}")


def _file_record(path: Path) -> FileRecord:
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return FileRecord(path.stat().st_size, digest)


_COMPONENTS: dict[int, Sequence[str]] = {1: ("Y",), 3: ("R", "G", "B")}


def _write_parts(path: Path, parts: Mapping[str, NDArray[Any]]) -> None:
    """One EXR part for each (H, W, C) array; EXR's rows run downward."""
    exr_parts = []
    for name, pixels in parts.items():
        letters = _COMPONENTS[pixels.shape[-1]]
        channels = {
            letter: np.ascontiguousarray(pixels[::-1, :, index])
            for index, letter in enumerate(letters)
        }
        header = {
            "name": name,
            "type": OpenEXR.scanlineimage,
            "compression": OpenEXR.ZIP_COMPRESSION,
        }
        exr_parts.append(OpenEXR.Part(header, channels, name))
    with without_lines(_HARMLESS):
        OpenEXR.File(exr_parts).write(str(path))
    if not _holds(path, parts):
        raise RuntimeError("not all of it was written")


def _holds(path: Path, parts: Mapping[str, NDArray[Any]]) -> bool:
    """Whether a file that was just written can be read and holds these parts.

    OpenEXR does not say when the last few kilobytes, which are all of a small file, found no room.
    """
    try:
        found = _read_parts(path)
    except InputError:
        return False
    return found.keys() == parts.keys() and all(
        found[name].tobytes() == pixels.tobytes() for name, pixels in parts.items()
    )


def _read_parts(path: Path) -> dict[str, NDArray[Any]]:
    """The parts' (H, W, C) arrays by name, in the precision in which they are stored."""
    try:
        exr = OpenEXR.File(str(path), separate_channels=True)
        result = {}
        for part in exr.parts:
            # Every channel of a part but its first carries the part's name in its own.
            named = {name.rsplit(".", 1)[-1]: c.pixels for name, c in part.channels.items()}
            letters = _COMPONENTS[len(named)]
            pixels = np.stack([named[letter] for letter in letters], axis=-1)
            result[part.name()] = np.ascontiguousarray(pixels[::-1])
    except (RuntimeError, KeyError, ValueError) as error:
        raise InputError(f"{path} cannot be read as a deep framebuffer; {_BAKE_AGAIN}") from error
    return result
