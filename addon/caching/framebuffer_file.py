# SPDX-License-Identifier: GPL-3.0-or-later
"""Deep framebuffers on the disk: OpenEXR files of a part for each channel.

Directions are two 16-bit numbers in one of 32 bits, other channels half or float32. EXR's rows run
downward, arrays' upward. What lies behind sheer surfaces has parts of its own: behind1_depth, ….
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from ..camplace.camera import CachingCamera
from ..errors import InputError
from ..native_lines import without_lines
from ..scene.octahedral import from_words, to_words
from .channels import CHANNEL_BY_NAME
from .file_record import BAKE_AGAIN
from .framebuffer import DeepFramebuffer
from .plan import ChannelPlan

# OpenEXR's wheel exports its C functions. In a Blender that loads its own, older OpenEXR as a
# shared library, that one's take their place, and the wheel's settings for kinds of compression
# that are newer than it find no part to apply to: two lines for each part, none of which is
# compressed so. No wheel for Python 3.14 is as old as Blender's library.
_HARMLESS = b"<compression>: (EXR_ERR_ARGUMENT_OUT_OF_RANGE) Part index (0) out of range"

_COMPONENTS: dict[int, Sequence[str]] = {1: ("Y",), 3: ("R", "G", "B")}


def parts_of(framebuffer: DeepFramebuffer) -> dict[str, NDArray[Any]]:
    """Its channels as they are stored: (H, W, C) by name."""
    parts: dict[str, NDArray[Any]] = {}
    for name, pixels in framebuffer.channels.items():
        if CHANNEL_BY_NAME[name].is_direction:
            parts[name] = to_words(pixels)
        else:
            is_half = framebuffer.precision(name) == "half"
            parts[name] = pixels.astype(np.float16) if is_half else pixels
    for number, picture in enumerate(framebuffer.behind, start=1):
        parts |= {_behind(number, name): part for name, part in parts_of(picture).items()}
    return parts


def _behind(number: int, name: str) -> str:
    return f"behind{number}_{name}" if number else name


def read_framebuffer(path: Path, camera: CachingCamera, plan: ChannelPlan) -> DeepFramebuffer:
    """A caching camera's channels from its file.

    Raises:
        InputError: the file is not of this form, or lacks something of the plan.
    """
    parts = read_parts(path)
    first, *behind = (
        _picture(path, parts, camera, plan, number) for number in range(1 + _behind_in(parts))
    )
    if not behind:
        return first
    return DeepFramebuffer(camera, first.channels, first.wide, tuple(behind))


def pictures_in(path: Path) -> int:
    """How many pictures a caching camera's file holds: the first, and what lies behind it.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        parts = OpenEXR.File(str(path), header_only=True).parts
        return 1 + _behind_in({part.name() for part in parts})
    except (RuntimeError, ValueError) as error:
        raise InputError(f"{path} cannot be read as a deep framebuffer; {BAKE_AGAIN}") from error


def _behind_in(names: Collection[str]) -> int:
    count = 0
    while _behind(count + 1, "depth") in names:
        count += 1
    return count


def _picture(
    path: Path,
    parts: Mapping[str, NDArray[Any]],
    camera: CachingCamera,
    plan: ChannelPlan,
    number: int,
) -> DeepFramebuffer:
    channels, wide = {}, set()
    for name in plan.stored:
        is_direction = CHANNEL_BY_NAME[name].is_direction
        components = 1 if is_direction else plan.components(name)
        shape = (camera.resolution, camera.resolution, components)
        pixels = parts.get(_behind(number, name))
        if pixels is None or pixels.shape != shape or (pixels.dtype == np.uint32) != is_direction:
            raise InputError(
                f"{path} lacks the channel {name} in the form that this Relume reads: another "
                f"version wrote it; {BAKE_AGAIN}"
            )
        if is_direction:
            channels[name] = from_words(pixels)
            continue
        if CHANNEL_BY_NAME[name].precision == "half" and pixels.dtype != np.float16:
            wide.add(name)
        channels[name] = pixels.astype(np.float32, copy=False)
    if "depth" in channels:
        nothing = channels["depth"] == 0.0
        for name, values in channels.items():
            if CHANNEL_BY_NAME[name].is_direction:
                np.copyto(values, np.float32(0.0), where=nothing)
    return DeepFramebuffer(camera, channels, frozenset(wide))


def write_parts(path: Path, parts: Mapping[str, NDArray[Any]]) -> None:
    """One EXR part for each (H, W, C) array; EXR's rows run downward."""
    exr_parts = []
    for name, pixels in parts.items():
        letters = _COMPONENTS[pixels.shape[-1]]
        channels = {
            letter: np.ascontiguousarray(pixels[::-1, :, index])
            for index, letter in enumerate(letters)
        }
        header = {
            "name": name,
            "type": OpenEXR.scanlineimage,
            "compression": OpenEXR.ZIP_COMPRESSION,
        }
        exr_parts.append(OpenEXR.Part(header, channels, name))
    with without_lines(_HARMLESS):
        OpenEXR.File(exr_parts).write(str(path))
    if not _holds(path, parts):
        raise RuntimeError("not all of it was written")


def _holds(path: Path, parts: Mapping[str, NDArray[Any]]) -> bool:
    """Whether a file that was just written can be read and holds these parts.

    OpenEXR does not say when the last few kilobytes, which are all of a small file, found no room.
    """
    try:
        found = read_parts(path)
    except InputError:
        return False
    return found.keys() == parts.keys() and all(
        found[name].tobytes() == pixels.tobytes() for name, pixels in parts.items()
    )


def read_parts(path: Path) -> dict[str, NDArray[Any]]:
    """The parts' (H, W, C) arrays by name, in the precision in which they are stored."""
    try:
        exr = OpenEXR.File(str(path), separate_channels=True)
        result = {}
        for part in exr.parts:
            # Every channel of a part but its first carries the part's name in its own.
            named = {name.rsplit(".", 1)[-1]: c.pixels for name, c in part.channels.items()}
            letters = _COMPONENTS[len(named)]
            pixels = np.stack([named[letter] for letter in letters], axis=-1)
            result[part.name()] = np.ascontiguousarray(pixels[::-1])
    except (RuntimeError, KeyError, ValueError) as error:
        raise InputError(f"{path} cannot be read as a deep framebuffer; {BAKE_AGAIN}") from error
    return result
