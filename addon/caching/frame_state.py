# SPDX-License-Identifier: GPL-3.0-or-later
"""What a cache holds of the frames of an animation, beside the one that it was begun with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

from .file_record import FileRecord
from .plan import ChannelPlan
from .seen_surfaces import Seen


@dataclass(frozen=True)
class FramePicture:
    """A caching camera's picture of another frame than the cache's first.

    Attributes:
        record: of its file.
        seen: what it shows; None if that is not known.
    """

    record: FileRecord
    seen: Seen | None

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {**vars(self.record), "seen": None if self.seen is None else self.seen.to_json()}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> FramePicture:
        """Raises KeyError, TypeError or ValueError on anything that to_json() did not write."""
        seen = data["seen"]
        return cls(FileRecord.from_json(data), None if seen is None else Seen.from_json(seen))


@dataclass(frozen=True)
class FrameState:
    """One frame.

    Attributes:
        fingerprint: of the scene at this frame.
        plan: the channels' constants at this frame; None if they are the cache's.
        held: which file holds each camera's picture, by camera id: its path within the cache's
            folder. Frames in which a camera sees nothing change name the same file.
        world: the world's picture at this frame, if it has one of its own.
        world_fingerprint: of the world that it shows.
    """

    fingerprint: str
    plan: ChannelPlan | None = None
    held: Mapping[int, str] = field(default_factory=dict)
    world: FileRecord | None = None
    world_fingerprint: str = ""

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "fingerprint": self.fingerprint,
            "plan": None if self.plan is None else self.plan.to_json(),
            "held": {str(number): name for number, name in self.held.items()},
            "world": None if self.world is None else vars(self.world),
            "world_fingerprint": self.world_fingerprint,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> FrameState:
        """Raises KeyError, TypeError or ValueError on anything that to_json() did not write."""
        plan, world = data["plan"], data["world"]
        return cls(
            str(data["fingerprint"]),
            None if plan is None else ChannelPlan.from_json(plan),
            {int(number): str(name) for number, name in data["held"].items()},
            None if world is None else FileRecord.from_json(world),
            str(data["world_fingerprint"]),
        )


def frame_ranges(frames: Iterable[int]) -> str:
    """Frames as they are told: 1-24, 30."""
    parts = []
    for _, run in groupby(enumerate(sorted(set(frames))), lambda pair: pair[1] - pair[0]):
        numbers = [number for _, number in run]
        ends = numbers[0], numbers[-1]
        parts.append(str(ends[0]) if ends[0] == ends[1] else f"{ends[0]}-{ends[1]}")
    return ", ".join(parts)
