# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache on disk as it is read: `store` says what lies where, and changes it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..errors import InputError
from .cache_names import WORLD_STEM, camera_stem, named
from .file_record import BAKE_AGAIN, FileRecord
from .frame_state import frame_ranges
from .framebuffer import DeepFramebuffer
from .framebuffer_file import pictures_in, read_framebuffer, read_parts
from .manifest import Manifest
from .manifest_file import read_manifest
from .plan import ChannelPlan


class StoredCache:
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
    def open(cls, folder: Path) -> Self:
        """Open an existing cache.

        Raises:
            InputError: there is none, or it is of another version, damaged or unreadable.
        """
        folder = Path(folder)
        return cls(folder, read_manifest(folder))

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

    def showing(self, fingerprint: str, frame: int) -> Self:
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

    def matching(self, fingerprint: str, frame: int) -> Self | None:
        """As `showing`, but None where that raises."""
        manifest = self.manifest
        if fingerprint == manifest.fingerprint:
            return self
        # Another frame that is alike may have another world.
        for number in sorted(manifest.frames, key=lambda number: number != frame):
            if manifest.frames[number].fingerprint == fingerprint:
                return self.at_frame(number)
        return None

    def at_frame(self, frame: int) -> Self:
        """The cache as it is at a frame that it holds beside its first: for reading only.

        Raises:
            InputError: it does not hold that frame.
        """
        manifest = self.manifest
        state = manifest.frames.get(frame)
        if state is None:
            baked = frame_ranges((manifest.frame, *manifest.frames))
            raise InputError(f"{self.folder} does not hold frame {frame}, but {baked}")
        return type(self)(self.folder, manifest.at_frame(frame), state.held)

    def camera_path(self, number: int) -> Path:
        """The file of a finished camera. Raises KeyError for another one."""
        return self.folder / (self._places.get(number) or self.manifest.first_name(number))

    def picture_path(self, number: int, record: FileRecord, frame: int | None = None) -> Path:
        """Where a picture of a camera belongs, of the first frame or of another one."""
        return self.folder / named(camera_stem(number, frame), record)

    @property
    def world_path(self) -> Path | None:
        """The file of the world's picture, if there is one."""
        record = self.manifest.world
        return None if record is None else self.folder / named(WORLD_STEM, record)

    def is_intact(self, number: int) -> bool:
        """Whether a camera's file is there and is what was written."""
        record = self.manifest.finished.get(number)
        return record is not None and record.is_of(self.camera_path(number))

    def has_world(self, fingerprint: str) -> bool:
        """Whether the picture of the world with this fingerprint is there, as it was written."""
        manifest, path = self.manifest, self.world_path
        if manifest.world is None or path is None or manifest.world_fingerprint != fingerprint:
            return False
        return manifest.world.is_of(path)

    def read_camera(self, number: int) -> DeepFramebuffer:
        """One deep framebuffer.

        Raises:
            InputError: its file is missing, damaged, or not the one that was baked.
        """
        camera = next((c for c in self.manifest.cameras if c.id == number), None)
        if camera is None or number not in self.manifest.finished:
            raise InputError(f"{self.folder} has no finished camera {number}; bake it")
        path = self.camera_path(number)
        self.manifest.finished[number].require(path)
        return read_framebuffer(path, camera, self.plan)

    def pictures_of(self, number: int) -> int:
        """How many pictures a finished camera's file holds, see `DeepFramebuffer.behind`; 1 of one
        that cannot be read, which reading it tells."""
        if not self.manifest.cut_out:
            return 1
        try:
            return pictures_in(self.camera_path(number))
        except InputError:
            return 1

    def read_finished(self) -> list[DeepFramebuffer]:
        """All finished deep framebuffers, in the cameras' order. Raises as read_camera()."""
        return [self.read_camera(camera.id) for camera in self.cameras]

    def read_world(self, fingerprint: str) -> NDArray[np.float32]:
        """The picture of the world with this fingerprint, (H, W, 3) float32, row 0 straight down.

        Raises:
            InputError: the cache has none, or one of another world, or it is damaged.
        """
        record, path = self.manifest.world, self.world_path
        if record is None or path is None:
            raise InputError(
                f"{self.folder} has no picture of the world, which varies with direction; "
                f"{BAKE_AGAIN}"
            )
        if self.manifest.world_fingerprint != fingerprint:
            raise InputError(
                f"the world changed after {self.folder} was baked; bake it again with --resume"
            )
        record.require(path)
        return read_parts(path)["world"].astype(np.float32, copy=False)
