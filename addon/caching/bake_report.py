# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake tells of itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .plan import ChannelPlan
from .plan_report import Precisions, float32_bytes, material_report, plan_report


@dataclass(frozen=True)
class BakeReport:
    """What a bake did.

    Attributes:
        cameras: caching cameras in the cache.
        baked, kept: how many were baked now, and kept from an earlier bake.
        texels: texels baked now.
        plan: which channels the cache holds, and what of the materials is approximated.
        precisions: in how many of the cameras baked now a channel was stored in a precision.
        raw_bytes, stored_bytes: of the cameras baked now, before and after compression.
        cache_bytes: on the disk, of all cameras in the cache that are finished.
        seconds: by stage: "place" (where cameras were placed), "prepare", "cycles" (renders),
            "read" (its pictures), "finish" (checks, smooth occlusion), "sight" (which objects
            are seen), "write" and "world".
        changed: what changed in the scene since the earlier bake: object 'Chair', material 'Wood'.
        again: by camera id, what it sees of it, and was baked again for.
        frames: by frame, the ids of the cameras that were baked for it.
        notes: a sentence for each thing that was baked again for another reason.
    """

    cameras: int
    baked: int
    kept: int
    texels: int
    plan: ChannelPlan
    precisions: Precisions
    raw_bytes: int
    stored_bytes: int
    cache_bytes: int
    seconds: Mapping[str, float]
    changed: tuple[str, ...] = ()
    again: Mapping[int, tuple[str, ...]] = field(default_factory=dict)
    frames: Mapping[int, list[int]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def approximations(self) -> tuple[str, ...]:
        """A sentence for each way in which a material is not cached as Cycles shows it."""
        return tuple(str(item) for item in self.plan.approximations)

    def to_json(self) -> dict[str, Any]:
        """Plain values.

        Beside the attributes: `channels` and `materials` as `plan_report` has them;
        `bytes_per_texel`, before and after compression and if every channel were float32, None
        where nothing was baked; and `approximations`.
        """
        return {
            "cameras": self.cameras,
            "baked": self.baked,
            "kept": self.kept,
            "texels": self.texels,
            "channels": plan_report(self.plan, self.precisions),
            "bytes_per_texel": {
                "raw": self.raw_bytes / self.texels if self.texels else None,
                "stored": self.stored_bytes / self.texels if self.texels else None,
                "all_float32": float32_bytes(self.plan),
            },
            "raw_bytes": self.raw_bytes,
            "stored_bytes": self.stored_bytes,
            "cache_bytes": self.cache_bytes,
            "changed": list(self.changed),
            "again": {str(number): list(seen) for number, seen in self.again.items()},
            "frames": {str(frame): list(cameras) for frame, cameras in self.frames.items()},
            "notes": list(self.notes),
            "seconds": dict(self.seconds),
            "materials": material_report(self.plan),
            "approximations": list(self.approximations),
        }
