# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache on disk: a manifest, and one multi-part OpenEXR file for each caching camera.

    <name>.relume/
      manifest.json     schema version, scene fingerprint, channel plan, cameras, their files
      cameras/0007.exr  a part for each channel
      world.exr         the world's picture, if it varies with direction

Every file is written under a temporary name, flushed to the disk and renamed; the manifest
comes last. A reader finds the old state or the new one, never half of either. The manifest
records each file's size and SHA-256, and nothing is read that differs.

Processes that bake different cameras of one cache change its manifest one at a time, each from
what it then says, so that none loses what another one finished.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..native_lines import without_lines
from ..whole_file import replacing, write_errors
from .channels import CHANNEL_BY_NAME
from .folder_lock import locked
from .framebuffer import DeepFramebuffer
from .octahedral import from_words, to_words
from .plan import ChannelPlan

SCHEMA = "relume-cache"
SCHEMA_VERSION = 2
MANIFEST_NAME = "manifest.json"
WORLD_NAME = "world.exr"
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
class FileRecord:
    """What the manifest knows of a finished file: its size in bytes and its SHA-256."""

    size: int
    sha256: str


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
    """

    fingerprint: str
    settings: Mapping[str, Any]
    plan: ChannelPlan
    cameras: tuple[CachingCamera, ...]
    finished: Mapping[int, FileRecord] = field(default_factory=dict)
    world: FileRecord | None = None
    world_fingerprint: str = ""

    def continues(self, other: Manifest) -> bool:
        """Whether it and `other` are states of one bake: all but what is finished is equal."""
        progress = ("finished", "world", "world_fingerprint")
        mine, theirs = self.to_json(), other.to_json()
        return all(mine[key] == theirs[key] for key in mine if key not in progress)

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
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Manifest:
        """Raises KeyError, TypeError or ValueError on anything that to_json() did not write."""
        return cls(
            fingerprint=str(data["fingerprint"]),
            settings=dict(data["settings"]),
            plan=ChannelPlan.from_json(data["plan"]),
            cameras=tuple(CachingCamera.from_json(camera) for camera in data["cameras"]),
            finished={int(n): _record(record) for n, record in data["finished"].items()},
            world=None if data["world"] is None else _record(data["world"]),
            world_fingerprint=str(data.get("world_fingerprint", "")),
        )


def _record(data: Mapping[str, Any]) -> FileRecord:
    return FileRecord(int(data["size"]), str(data["sha256"]))


class CacheStore:
    """One cache folder.

    Attributes:
        folder: where it is.
        manifest: its state, as last read or written.
    """

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        self.folder = folder
        self.manifest = manifest

    @classmethod
    def open(cls, folder: Path) -> CacheStore:
        """Open an existing cache.

        Raises:
            InputError: there is none, or it is of another version, damaged or unreadable.
        """
        folder = Path(folder)
        path = folder / MANIFEST_NAME
        if not path.is_file():
            raise InputError(f"{folder} holds no Relume cache; bake one there first")
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(f"{path} cannot be read: {error.strerror}") from error
        except ValueError as error:
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
        try:
            return cls(folder, Manifest.from_json(data))
        except (KeyError, TypeError, ValueError, AttributeError) as error:
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
            raise InputError(
                f"{self.folder} is the cache of another scene, or of this one before its objects "
                "or materials changed; bake it again or choose another folder"
            )

    def camera_path(self, number: int) -> Path:
        """The file of a camera."""
        return self.folder / "cameras" / f"{number:04d}.exr"

    def is_intact(self, number: int) -> bool:
        """Whether a camera's file is there and is what was written."""
        record = self.manifest.finished.get(number)
        path = self.camera_path(number)
        return record is not None and path.is_file() and _file_record(path) == record

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
            is_normal = CHANNEL_BY_NAME[name].field == "normal"
            components = 1 if is_normal else self.plan.components(name)
            shape = (camera.resolution, camera.resolution, components)
            pixels = parts.get(name)
            if pixels is None or pixels.shape != shape or (pixels.dtype == np.uint32) != is_normal:
                raise InputError(f"{path} lacks the channel {name}; {_BAKE_AGAIN}")
            if is_normal:
                channels[name] = from_words(pixels)
                continue
            if CHANNEL_BY_NAME[name].precision == "half" and pixels.dtype != np.float16:
                wide.add(name)
            channels[name] = pixels.astype(np.float32, copy=False)
        if "depth" in channels:
            nothing = channels["depth"] == 0.0
            for name, values in channels.items():
                if CHANNEL_BY_NAME[name].field == "normal":
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
        path = self.folder / WORLD_NAME
        _check(path, self.manifest.world)
        return _read_parts(path)["world"].astype(np.float32, copy=False)

    def write_camera(self, framebuffer: DeepFramebuffer) -> FileRecord:
        """Write one deep framebuffer; the caller records it in the manifest.

        Raises:
            InputError: the disk is full or the folder cannot be written; nothing is left.
        """
        parts: dict[str, NDArray[Any]] = {}
        for name, pixels in framebuffer.channels.items():
            if CHANNEL_BY_NAME[name].field == "normal":
                parts[name] = to_words(pixels)
            else:
                is_half = framebuffer.precision(name) == "half"
                parts[name] = pixels.astype(np.float16) if is_half else pixels
        return self._write_exr(self.camera_path(framebuffer.camera.id), parts)

    def write_world(self, picture: NDArray[np.float32]) -> FileRecord:
        """Write the world's picture. Raises as write_camera()."""
        return self._write_exr(self.folder / WORLD_NAME, {"world": picture})

    def write_manifest(self, manifest: Manifest) -> None:
        """Replace the manifest. Raises as write_camera()."""
        text = json.dumps(manifest.to_json(), indent=1) + "\n"
        with replacing(self.folder / MANIFEST_NAME, _ELSEWHERE) as temporary:
            temporary.write_text(text, encoding="utf-8")
        self.manifest = manifest

    @contextmanager
    def changing(self) -> Iterator[Manifest]:
        """The manifest as it is on the disk now, which no one else changes in this block.

        Raises:
            InputError: as write_camera(), or another bake began in this folder meanwhile.
        """
        with self.exclusive(self.folder):
            now = CacheStore.open(self.folder).manifest
            if not now.continues(self.manifest):
                raise InputError(
                    f"another bake took the place of this one in {self.folder}; choose another "
                    "folder for one of them"
                )
            yield now

    def add_camera(self, framebuffer: DeepFramebuffer) -> FileRecord:
        """Write one deep framebuffer and record it in the manifest. Raises as changing()."""
        record = self.write_camera(framebuffer)
        with self.changing() as now:
            finished = {**now.finished, framebuffer.camera.id: record}
            self.write_manifest(replace(now, finished=finished))
        return record

    def add_world(self, picture: NDArray[np.float32], fingerprint: str) -> FileRecord:
        """Write the world's picture and record it in the manifest. Raises as changing()."""
        record = self.write_world(picture)
        with self.changing() as now:
            self.write_manifest(replace(now, world=record, world_fingerprint=fingerprint))
        return record

    def sweep(self) -> None:
        """Remove files of an earlier cache, and what a killed process left half-written."""
        keep = {self.camera_path(camera.id) for camera in self.manifest.cameras}
        stale = [p for p in (self.folder / "cameras").glob("*.exr") if p not in keep]
        if self.manifest.world is None:
            stale.append(self.folder / WORLD_NAME)
        before = time.time() - _PART_SECONDS
        stale += [p for p in self.folder.rglob(".*.part") if p.stat().st_mtime < before]
        for path in stale:
            path.unlink(missing_ok=True)

    def _write_exr(self, path: Path, parts: Mapping[str, NDArray[Any]]) -> FileRecord:
        with replacing(path, _ELSEWHERE) as temporary:
            _write_parts(temporary, parts)
            return _file_record(temporary)


def _check(path: Path, record: FileRecord) -> None:
    if not path.is_file():
        raise InputError(f"{path} is missing; {_BAKE_AGAIN}")
    if _file_record(path) != record:
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
