# SPDX-License-Identifier: GPL-3.0-or-later
"""What a cache is: from which scene it was baked, its channels, its cameras and their pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..camplace.camera import CachingCamera
from .cache_names import camera_stem, named
from .file_record import FileRecord
from .frame_state import FramePicture, FrameState
from .plan import ChannelPlan
from .seen_surfaces import Seen
from .surfaces import Surfaces


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

    def at_frame(self, frame: int) -> Manifest:
        """The state of the same cache at a frame that it holds beside its first.

        Raises:
            KeyError: it does not hold that frame.
        """
        state = self.frames[frame]
        found = {number: self._picture(number, name) for number, name in state.held.items()}
        own_world = state.world is not None
        return replace(
            self,
            fingerprint=state.fingerprint,
            plan=state.plan or self.plan,
            finished={n: picture.record for n, picture in found.items() if picture is not None},
            seen={n: p.seen for n, p in found.items() if p is not None and p.seen is not None},
            world=state.world if own_world else self.world,
            world_fingerprint=state.world_fingerprint if own_world else self.world_fingerprint,
        )

    def first_name(self, number: int) -> str:
        """The path within the folder of a finished camera's picture of the cache's first frame."""
        return named(camera_stem(number), self.finished[number])

    def _picture(self, number: int, name: str) -> FramePicture | None:
        """What is known of a file that a frame names for a camera; None if it is gone."""
        if number in self.finished and self.first_name(number) == name:
            return FramePicture(self.finished[number], self.seen.get(number))
        return self.pictures.get(name)

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
