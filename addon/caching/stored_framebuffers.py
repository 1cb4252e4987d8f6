# SPDX-License-Identifier: GPL-3.0-or-later
"""A cache's deep framebuffers, each read when it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, overload

from .framebuffer import DeepFramebuffer

if TYPE_CHECKING:
    from .store import CacheStore


class StoredFramebuffers(Sequence[DeepFramebuffer]):
    """The framebuffers of a cache's finished cameras, in their order; none stays in memory."""

    def __init__(self, store: CacheStore) -> None:
        self._store = store
        self._numbers = [camera.id for camera in store.cameras]

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, index: int) -> DeepFramebuffer: ...

    @overload
    def __getitem__(self, index: slice) -> list[DeepFramebuffer]: ...

    def __getitem__(self, index: int | slice) -> DeepFramebuffer | list[DeepFramebuffer]:
        """Raises InputError as `CacheStore.read_camera`."""
        if isinstance(index, slice):
            return [self._store.read_camera(number) for number in self._numbers[index]]
        return self._store.read_camera(self._numbers[index])
