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
class Store:
    """`cameras` are a cache's finished ones: of 0 to 7, say, these."""

    cameras: tuple[Camera, ...] = (Camera(7), Camera(2), Camera(5))
    read: list[int] = field(default_factory=list)

    def read_camera(self, number: int) -> str:
        self.read.append(number)
        return f"framebuffer {number}"


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
