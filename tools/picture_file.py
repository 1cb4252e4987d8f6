# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures on disk: OpenEXR for scene-linear values, PNG for display-encoded ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from addon.errors import InputError
from addon.whole_file import replacing


@dataclass(frozen=True)
class PictureFile:
    """What was read from a file.

    Attributes:
        rgb: (H, W, 3) float32, row 0 at the bottom.
        linear: True for scene-linear Rec.709 (EXR), False for display-encoded in [0, 1] (PNG).
        extra: every other channel, (H, W) float32, row 0 at the bottom.
        header: the numbers that the file's header carries under names beginning "relume".
        path: where it came from.
    """

    rgb: NDArray[np.float32]
    linear: bool
    extra: Mapping[str, NDArray[np.float32]]
    header: Mapping[str, float]
    path: Path


def read_picture(path: Path) -> PictureFile:
    """Read an EXR or a PNG.

    Raises:
        InputError: the file is missing, damaged, of another kind, or holds values that are
            not finite.
    """
    if not path.is_file():
        raise InputError(f"There is no picture {path}; check the path.")
    suffix = path.suffix.lower()
    if suffix not in (".exr", ".png"):
        raise InputError(f"{path} is neither an .exr nor a .png file; give one of these.")
    picture = _read_exr(path) if suffix == ".exr" else _read_png(path)
    if not np.isfinite(picture.rgb).all():
        broken = (~np.isfinite(picture.rgb)).any(axis=-1)
        if broken.all():
            raise InputError(f"{path} has no pixel that is finite; it shows nothing to measure.")
        raise InputError(
            f"{path} has {broken.sum()} of {broken.size} pixels that are not finite; "
            "render it again."
        )
    return picture


def _read_exr(path: Path) -> PictureFile:
    import OpenEXR

    if path.read_bytes()[:4] != b"\x76\x2f\x31\x01":  # the format's magic number, 20000630
        raise InputError(f"{path} is not an OpenEXR file; render it again.")
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            channels = {
                name: np.asarray(channel.pixels, dtype=np.float32)[::-1].copy()
                for part in file.parts  # Blender writes a part for each pass
                for name, channel in part.channels.items()
            }
            header = {k: float(v) for k, v in file.header().items() if k.startswith("relume")}
    except (RuntimeError, OSError, ValueError, TypeError) as error:
        raise InputError(f"{path} cannot be read as OpenEXR ({error}); render it again.") from None
    prefix = _prefix(channels)
    if prefix is None or any(prefix + c not in channels for c in "RGB"):
        raise InputError(f"{path} has no R, G and B channels; give a colour picture.")
    rgb = np.stack([channels.pop(prefix + c) for c in "RGB"], axis=-1)
    return PictureFile(rgb, linear=True, extra=channels, header=header, path=path)


def _prefix(channels: Mapping[str, object]) -> str | None:
    """What stands before R, G and B: nothing, or Blender's view layer and pass."""
    if "R" in channels:
        return ""
    return next((name[:-1] for name in channels if name.endswith(".Combined.R")), None)


def _read_png(path: Path) -> PictureFile:
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            image.load()
            mode = image.mode
            pixels = np.asarray(image if mode in ("I;16", "RGB") else image.convert("RGB"))
    except (UnidentifiedImageError, OSError, SyntaxError) as error:
        raise InputError(f"{path} cannot be read as PNG ({error}); render it again.") from None
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[..., None], 3, axis=-1)
    rgb = pixels[::-1].astype(np.float32) / np.float32(np.iinfo(pixels.dtype).max)
    return PictureFile(rgb, linear=False, extra={}, header={}, path=path)


def write_exr(
    path: Path,
    rgba: NDArray[np.float32],
    extra: Mapping[str, NDArray[np.float32]] | None = None,
    header: Mapping[str, float] | None = None,
) -> None:
    """Write a scene-linear picture, complete or not at all.

    Args:
        path: the file; an existing one is replaced.
        rgba: (H, W, 3) or (H, W, 4), row 0 at the bottom.
        extra: further channels, (H, W) by name.
        header: numbers to keep, under names that begin with "relume".

    Raises:
        InputError: the file cannot be written.
    """
    import OpenEXR

    channels = {
        name: np.ascontiguousarray(rgba[::-1, :, i], dtype=np.float32)
        for i, name in enumerate("RGBA"[: rgba.shape[-1]])
    }
    for name, values in (extra or {}).items():
        channels[name] = np.ascontiguousarray(values[::-1], dtype=np.float32)
    settings = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    make_folder(path.parent)
    with (
        replacing(path) as part,
        OpenEXR.File(settings | dict(header or {}), channels) as file,
    ):
        file.write(str(part))


def write_png(path: Path, encoded: NDArray[np.floating]) -> None:
    """Write display-encoded values in [0, 1], (H, W, 3) or (H, W), row 0 at the bottom.

    Raises:
        InputError: the file cannot be written.
    """
    from PIL import Image

    pixels = np.rint(np.clip(np.asarray(encoded[::-1]), 0.0, 1.0) * 255.0).astype(np.uint8)
    make_folder(path.parent)
    with replacing(path) as part:
        Image.fromarray(pixels).save(part, format="PNG", optimize=True)


def make_folder(folder: Path) -> None:
    """Make a folder that files are to be written to. Raises InputError when it cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder} cannot be made ({error.strerror}); choose another.") from None
