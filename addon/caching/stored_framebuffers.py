# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache's deep framebuffers, each read when it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, overload

from .framebuffer import DeepFramebuffer

if TYPE_CHECKING:
    from .store import CacheStore


class StoredFramebuffers(Sequence[DeepFramebuffer]):
    """The framebuffers of a cache's finished cameras, in their order; none stays in memory.

    What a camera sees behind sheer surfaces is a framebuffer of its own, after the camera's first.
    All of one camera's lie in one file: they stay until the last of them was asked for.
    """

    def __init__(self, store: CacheStore) -> None:
        self._store = store
        self._kept: tuple[int, tuple[DeepFramebuffer, ...]] | None = None
        self._numbers = [
            (camera.id, picture)
            for camera in store.cameras
            for picture in range(store.pictures_of(camera.id))
        ]

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, index: int) -> DeepFramebuffer: ...

    @overload
    def __getitem__(self, index: slice) -> list[DeepFramebuffer]: ...

    def __getitem__(self, index: int | slice) -> DeepFramebuffer | list[DeepFramebuffer]:
        """Raises InputError as `CacheStore.read_camera`."""
        if isinstance(index, slice):
            return [self._read(*numbers) for numbers in self._numbers[index]]
        return self._read(*self._numbers[index])

    def _read(self, camera: int, picture: int) -> DeepFramebuffer:
        kept, self._kept = self._kept, None
        if kept is None or kept[0] != camera:
            kept = camera, self._store.read_camera(camera).pictures
        if picture + 1 < len(kept[1]):
            self._kept = kept
        return kept[1][picture]
