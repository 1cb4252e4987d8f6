# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes caching cameras of a scene at one frame, one after the other."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from typing import Any

from ..camplace.camera import CachingCamera
from ..progress import Progress
from ..scene.geometry_reader import NO_MATERIAL
from ..time_left import time_left
from .aov_render import staged
from .bake_camera import bake_camera
from .file_record import FileRecord
from .framebuffer import DeepFramebuffer
from .lights_off import lights_off
from .plan import ChannelPlan
from .ray_occlusion import OcclusionCaster
from .scene_state import SceneState
from .seen_surfaces import Seen, SurfaceSight
from .specialize import SpecializedMaterial, needs_sky

# Rays of ambient occlusion from a texel, at most, where Cycles looks through each leaf on their
# way: they take twenty times as long as among what is solid.
_MOST_TO_SKY = 8

# Puts a picture, and what it shows, where it belongs.
Keep = Callable[[DeepFramebuffer, Seen], FileRecord]


@dataclass
class Baked:
    """What the cameras took: bytes, seconds by stage, and channels by their precisions."""

    cameras: int = 0
    texels: int = 0
    raw_bytes: int = 0
    stored_bytes: int = 0
    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    precisions: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))

    def add(self, framebuffer: DeepFramebuffer, record: FileRecord) -> None:
        """Count one camera's picture and file."""
        self.cameras += 1
        self.texels += framebuffer.camera.resolution**2
        self.raw_bytes += framebuffer.raw_bytes
        self.stored_bytes += record.size
        for name in framebuffer.channels:
            self.precisions[name][framebuffer.precision(name)] += 1


@dataclass(frozen=True)
class CamerasBake:
    """A scene, ready to be baked at its current frame.

    Attributes:
        scene: a `bpy.types.Scene`, whose materials are specialized.
        state: as it is at this frame.
        plan: of its materials.
        materials: what `plan` numbers.
        ambient_rays: rays of ambient occlusion from each texel, at most; 0 for none.
        texel_samples: of each texel, whose mean its colours are.
        tells_what_is_seen: whether it is found out what the pictures show; takes its time.
    """

    scene: Any
    state: SceneState
    plan: ChannelPlan
    materials: Sequence[SpecializedMaterial]
    ambient_rays: int
    texel_samples: int = 1
    tells_what_is_seen: bool = True

    def run(
        self, cameras: Sequence[CachingCamera], keep: Keep, baked: Baked, progress: Progress
    ) -> None:
        """Bake `cameras`, give each picture to `keep`, and count it in `baked`.

        Raises:
            InputError: see `bake_camera`; or raised by `keep`.
            Cancelled: raised by `progress`, which is asked before each camera.
        """
        if not cameras:
            return
        texels = [camera.resolution**2 for camera in cameras]
        timed: list[tuple[int, float]] = []
        plan, geometry = self.plan, self.state.geometry
        in_sky = needs_sky(plan, self.materials)
        rays = min(self.ambient_rays, _MOST_TO_SKY) if in_sky else self.ambient_rays
        occlusion = OcclusionCaster(geometry, rays)
        sight = SurfaceSight(geometry, self.state.states)
        sight_seconds = write_seconds = 0.0
        has_default = NO_MATERIAL in plan.material_names
        with (
            lights_off() if in_sky else nullcontext(),
            staged(
                self.scene,
                plan,
                has_normal=has_default,
                sky_rays=rays if in_sky else 0,
                texel_samples=self.texel_samples,
            ) as stage,
        ):
            for number, camera in enumerate(cameras, start=1):
                done = len(timed)
                left = time_left(timed, texels[done:])
                message = f"Baking camera {number} of {len(cameras)}{left}"
                progress(sum(texels[:done]) / sum(texels), message)
                started = time.monotonic()
                framebuffer = bake_camera(stage, camera, plan, self.materials, occlusion)
                rendered = time.monotonic()
                seen = sight.seen(framebuffer, plan) if self.tells_what_is_seen else Seen()
                told = time.monotonic()
                baked.add(framebuffer, keep(framebuffer, seen))
                written = time.monotonic()
                sight_seconds += told - rendered
                write_seconds += written - told
                timed.append((camera.resolution**2, written - started))
            seconds = {**stage.seconds, "sight": sight_seconds, "write": write_seconds}
        seconds["finish"] = sum(took for _, took in timed) - sum(seconds.values())
        for name, took in seconds.items():
            baked.seconds[name] += took
