# SPDX-License-Identifier: GPL-3.0-or-later
"""Confidence as a picture, and whether it tells where the error is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .metrics import encode_srgb, quantize, squared_error
from .picture_file import write_exr, write_png

# As glsl/passes/heat_map.glsl has them, from none over half to all.
COLORS = np.array([[0.843, 0.098, 0.110], [1.0, 0.9, 0.55], [0.173, 0.482, 0.714]])
# Tenths of the surface's pixels.
PARTS = 10
# A pixel of `Confidence.read` that sees no surface.
NOTHING = (-1.0, 0.0, 0.0, 0.0)


def confidence_colors(confidence: NDArray[np.float32]) -> NDArray[np.float64]:
    """(H, W, 3) display colours of (H, W, 4), see `Confidence.read`; black where nothing is."""
    trust = confidence[..., 0].astype(np.float64)
    colors = [np.interp(trust, (0.0, 0.5, 1.0), COLORS[:, i]) for i in range(3)]
    return np.where(trust[..., None] < 0.0, 0.0, np.stack(colors, axis=-1))


def write_confidence(path: Path, confidence: NDArray[np.float32]) -> None:
    """Write it as a heat map, .png; or, .exr, as values with what they are made of.

    Raises:
        InputError: it cannot be written.
    """
    if path.suffix.lower() == ".png":
        write_png(path, confidence_colors(confidence))
        return
    trust = confidence[..., 0]
    shown = np.where(trust < 0.0, 0.0, trust)
    rgba = np.stack([shown, shown, shown, trust >= 0.0], axis=-1).astype(np.float32)
    parts = {
        f"{name}.V": np.ascontiguousarray(confidence[..., i])
        for i, name in enumerate(("Share", "Sharpness", "Facing"), start=1)
    }
    write_exr(path, rgba, parts)


def error_by_confidence(
    confidence: NDArray[np.float32],
    reference: NDArray[np.floating],
    image: NDArray[np.floating],
) -> list[dict[str, Any]]:
    """The error of each tenth of the pixels that see a surface, the least trusted first.

    Args:
        confidence: (H, W, 4), see `Confidence.read`.
        reference: (H, W, 3) scene-linear.
        image: (H, W, 3) scene-linear.

    Returns:
        Of each part its confidences from `least` to `most`, and the root mean square of the error
        of its luma, in steps of an 8-bit display.
    """
    trust = confidence[..., 0]
    seen = trust >= 0.0
    pictures = [quantize(encode_srgb(picture)) for picture in (reference, image)]
    error = squared_error(pictures[0], pictures[1])[1][seen]
    order = np.argsort(trust[seen], kind="stable")
    return [
        {
            "least": float(trust[seen][part[0]]),
            "most": float(trust[seen][part[-1]]),
            "rms": float(np.sqrt(error[part].mean())),
        }
        for part in np.array_split(order, PARTS)
        if len(part)
    ]
