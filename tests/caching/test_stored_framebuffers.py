# SPDX-License-Identifier: GPL-3.0-or-later
"""Framebuffers are read when they are asked for, and only those that are finished."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, cast

import pytest

from addon.caching.stored_framebuffers import StoredFramebuffers


@dataclass
class Camera:
    id: int


@dataclass
class Read:
    """A framebuffer, with what lies behind sheer surfaces."""

    name: str
    behind: int = 0

    @property
    def pictures(self) -> tuple[str, ...]:
        return (self.name, *(f"{self.name}, behind {n + 1}" for n in range(self.behind)))


@dataclass
class Store:
    """`cameras` are a cache's finished ones: of 0 to 7, say, these."""

    cameras: tuple[Camera, ...] = (Camera(7), Camera(2), Camera(5))
    behind: dict[int, int] = field(default_factory=dict)
    read: list[int] = field(default_factory=list)

    def pictures_of(self, number: int) -> int:
        return 1 + self.behind.get(number, 0)

    def read_camera(self, number: int) -> Read:
        self.read.append(number)
        return Read(f"framebuffer {number}", self.behind.get(number, 0))


def test_each_is_read_when_it_is_asked_for() -> None:
    store = Store()
    framebuffers = StoredFramebuffers(cast("Any", store))
    assert len(framebuffers) == 3
    assert store.read == []
    assert [str(one) for one in framebuffers] == ["framebuffer 7", "framebuffer 2", "framebuffer 5"]
    assert store.read[:3] == [7, 2, 5]
    assert cast("Any", framebuffers[1]) == "framebuffer 2"
    assert cast("Any", framebuffers[1:]) == ["framebuffer 2", "framebuffer 5"]
    with pytest.raises(IndexError):
        framebuffers[3]


def test_a_cache_without_a_finished_camera_is_empty() -> None:
    assert not StoredFramebuffers(cast("Any", Store(cameras=())))


def test_what_lies_behind_comes_after_its_camera() -> None:
    store = Store(behind={2: 2})
    framebuffers = StoredFramebuffers(cast("Any", store))
    assert [str(one) for one in framebuffers] == [
        "framebuffer 7",
        "framebuffer 2",
        "framebuffer 2, behind 1",
        "framebuffer 2, behind 2",
        "framebuffer 5",
    ]
    # Of each file all is read at once, and not kept any longer.
    assert store.read == [7, 2, 5]
    assert cast("Any", framebuffers[3]) == "framebuffer 2, behind 2"
    assert cast("Any", framebuffers[2]) == "framebuffer 2, behind 1"
    assert cast("Any", framebuffers[0]) == "framebuffer 7"
    assert store.read == [7, 2, 5, 2, 2, 7]
