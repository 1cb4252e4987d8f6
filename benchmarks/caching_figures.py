# SPDX-License-Identifier: GPL-3.0-or-later
"""The arithmetic of `benchmarks.caching`: sizes of textures, times of frames, what is enough."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

# What a cache must keep to.
LEAST_RATIO = 6.0
MOST_DB = 0.2
MOST_SHARE_OF_FRAME = 0.25
MOST_GPU_BYTES = 1 << 30

FRAME_SAMPLES = 256

# Blender's names of texture formats: components, bits of each, kind.
_FORMAT = re.compile(r"(?:SRGB8_A8)|(R|RG|RGB|RGBA)(8|16|32)(?:F|I|UI|_SNORM)?")
# Those whose components have different bits, all of four bytes.
_FOUR_BYTES = frozenset({"RGB10_A2", "RGB10_A2UI", "R11F_G11F_B10F", "SRGB8_A8"})


@dataclass(frozen=True)
class MadeTexture:
    """A texture that was made on the GPU: its size, layers (1 for a plain one) and format."""

    width: int
    height: int
    layers: int
    texture_format: str

    @property
    def size(self) -> int:
        """Bytes that its texels take."""
        return self.width * self.height * self.layers * texel_bytes(self.texture_format)


def texel_bytes(texture_format: str) -> int:
    """Bytes of a texel.

    Raises:
        ValueError: a format that is not known.
    """
    if texture_format in _FOUR_BYTES:
        return 4
    parts = _FORMAT.fullmatch(texture_format)
    if parts is None:
        raise ValueError(f"texture format {texture_format!r}")
    return len(parts[1]) * int(parts[2]) // 8


@dataclass(frozen=True)
class FrameTime:
    """Seconds of a frame by its samples, on the line through two that were measured.

    Attributes:
        fixed: what a frame takes before its first sample.
        sample: what each sample of all pixels takes.
    """

    fixed: float
    sample: float

    @classmethod
    def through(cls, measured: Mapping[int, float]) -> FrameTime:
        """The line through the least and the most samples; neither part is negative.

        Raises:
            ValueError: fewer than two numbers of samples.
        """
        if len(measured) < 2:
            raise ValueError("a line takes two numbers of samples")
        low, high = min(measured), max(measured)
        sample = max(0.0, (measured[high] - measured[low]) / (high - low))
        return cls(max(0.0, measured[low] - low * sample), sample)

    def at(self, samples: int) -> float:
        """Seconds of a frame with so many samples."""
        return self.fixed + samples * self.sample


def loss_db(exact: float, shipped: float) -> float:
    """How many decibels compression costs: the PSNR without it less the PSNR with it.

    Two pictures without any error differ by nothing.
    """
    return 0.0 if exact == shipped else exact - shipped


@dataclass(frozen=True)
class Bound:
    """A figure beside what it must keep to.

    Attributes:
        name: which figure.
        value: what was measured.
        bound: what it must be, at least or at most.
        at_least: which of them.
    """

    name: str
    value: float
    bound: float
    at_least: bool

    @property
    def kept(self) -> bool:
        """Whether it is kept; what is not a number is not."""
        if math.isnan(self.value):
            return False
        return self.value >= self.bound if self.at_least else self.value <= self.bound

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return {**vars(self), "kept": self.kept}


def size_bounds(all_float32: int, disk: int, gpu: int | None, preset: str) -> list[Bound]:
    """What the sizes of a cache, in bytes, must keep to beside all channels in float32: where it
    lies, on disk and on the GPU. What the files hold unpacked is nowhere, and has no bound."""
    bounds = [
        Bound("times smaller on disk", all_float32 / max(disk, 1), LEAST_RATIO, at_least=True)
    ]
    if gpu is not None:
        ratio = all_float32 / max(gpu, 1)
        bounds.append(Bound("times smaller on the GPU", ratio, LEAST_RATIO, at_least=True))
        if preset == "balanced":
            bounds.append(Bound("bytes on the GPU", gpu, MOST_GPU_BYTES, at_least=False))
    return bounds


def shortfalls(bounds: Iterable[Bound]) -> list[str]:
    """A sentence for each bound that is not kept."""
    return [
        f"{bound.name}: {bound.value:,.4g}, not {'at least' if bound.at_least else 'at most'} "
        f"{bound.bound:,.4g}"
        for bound in bounds
        if not bound.kept
    ]
