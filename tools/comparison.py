# SPDX-License-Identifier: GPL-3.0-or-later
"""One picture held against its reference: the figures, and pictures of the difference."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.errors import InputError

from . import edges, metrics
from .picture_file import PictureFile, write_png

# Channels that tools/reference.py adds to its pictures, and numbers in their headers.
DEPTH_CHANNEL = "guide.depth"
OBJECT_CHANNEL = "guide.object"
PIXEL_HEADER = "relumePixelSize"
PERSPECTIVE_HEADER = "relumePerspective"
# The difference picture shows errors this many times brighter than they are.
DIFFERENCE_GAIN = 8.0


@dataclass(frozen=True)
class Comparison:
    """What was measured.

    Attributes:
        report: plain values, as `relume compare --json` prints them.
        reference, image: (H, W, 3) float64, display-encoded in [0, 1], row 0 at the bottom.
        flip: (H, W) float32, FLIP's error in [0, 1].
        edge: (H, W) bool, the pixels that lie at an edge of the reference.
    """

    report: dict[str, Any]
    reference: NDArray[np.float64]
    image: NDArray[np.float64]
    flip: NDArray[np.float32]
    edge: NDArray[np.bool_]

    @property
    def difference(self) -> NDArray[np.float64]:
        """(H, W, 3): the encoded pictures' absolute difference, brightened, in [0, 1]."""
        return np.clip(np.abs(self.image - self.reference) * DIFFERENCE_GAIN, 0.0, 1.0)

    def write(self, folder: Path) -> list[str]:
        """Leave the difference, FLIP and edge pictures in a folder; returns their paths."""
        pictures = {
            "difference.png": self.difference,
            "flip.png": false_color(self.flip),
            "edges.png": self.edge.astype(np.float64),
        }
        for name, picture in pictures.items():
            write_png(folder / name, picture)
        return [str(folder / name) for name in pictures]


def false_color(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """(H, W) in [0, 1] to (H, W, 3), the magma map that FLIP's authors use."""
    from matplotlib import colormaps

    return np.asarray(colormaps["magma"](np.clip(values, 0.0, 1.0))[..., :3], dtype=np.float64)


def edge_mask(reference: PictureFile) -> tuple[NDArray[np.bool_], str]:
    """The reference's edges, (H, W), and how they were found: "surfaces" or "luma"."""
    guides = reference.extra
    if DEPTH_CHANNEL in guides and OBJECT_CHANNEL in guides and PIXEL_HEADER in reference.header:
        mask = edges.surface_edges(
            guides[DEPTH_CHANNEL],
            guides[OBJECT_CHANNEL],
            reference.header[PIXEL_HEADER],
            perspective=reference.header.get(PERSPECTIVE_HEADER, 1.0) != 0.0,
        )
        return mask, "surfaces"
    encoded = metrics.encode_srgb(reference.rgb) if reference.linear else reference.rgb
    return edges.luma_edges(encoded), "luma"


def compare_pictures(reference: PictureFile, image: PictureFile) -> Comparison:
    """Measure `image` against `reference`.

    Raises:
        InputError: they differ in size, or one is scene-linear and the other is not.
    """
    if reference.rgb.shape != image.rgb.shape:
        sizes = [f"{p.path} is {p.rgb.shape[1]}x{p.rgb.shape[0]}" for p in (reference, image)]
        raise InputError(f"{' and '.join(sizes)}; render both at one size.")
    if reference.linear != image.linear:
        raise InputError(
            f"{reference.path} and {image.path} are of different kinds; "
            "give two .exr or two .png files."
        )
    linear = reference.linear
    shown = [metrics.encode_srgb(p.rgb) if linear else p.rgb for p in (reference, image)]
    levels = [metrics.quantize(p) for p in shown]
    rgb, luma = metrics.squared_error(*levels)
    similarity = metrics.structural_similarity(*levels)
    relative = metrics.relative_squared_error(reference.rgb, image.rgb) if linear else None
    flip = metrics.flip_map(reference.rgb, image.rgb, linear=linear)
    edge, found_by = edge_mask(reference)

    def figures(mask: NDArray[np.bool_] | None) -> dict[str, float | None]:
        rgb_mean, luma_mean = (metrics.mean_over(v, mask) for v in (rgb, luma))
        return {
            "psnr_rgb": None if rgb_mean is None else metrics.psnr(rgb_mean),
            "psnr_luma": None if luma_mean is None else metrics.psnr(luma_mean),
            "ssim": metrics.mean_over(similarity, mask),
            "flip": metrics.mean_over(flip, mask),
            "rel_mse": None if relative is None else metrics.mean_over(relative, mask),
        }

    report = {
        "reference": str(reference.path),
        "image": str(image.path),
        "width": int(edge.shape[1]),
        "height": int(edge.shape[0]),
        "flip_kind": "HDR-FLIP" if linear else "LDR-FLIP",
        "identical": bool(np.array_equal(reference.rgb, image.rgb)),
        "whole": figures(None),
        "away_from_edges": figures(~edge)
        | {
            "edges_from": found_by,
            "radius_pixels": edges.RADIUS,
            "share_of_pixels": float(np.mean(~edge)),
        },
    }
    encoded = [np.asarray(p, dtype=np.float64) for p in shown]
    return Comparison(report, encoded[0], encoded[1], flip, edge)


def describe(report: dict[str, Any]) -> str:
    """A few lines for a person."""

    def number(value: float | None, form: str) -> str:
        return "-" if value is None else format(value, form)

    heads = ("PSNR luma", 11), ("SSIM", 10), (report["flip_kind"], 10), ("relMSE", 10)
    lines = [f"{'':17}{'PSNR RGB':>10}" + "".join(f"{name:>{width}}" for name, width in heads)]
    for key, title in (("whole", "whole picture"), ("away_from_edges", "away from edges")):
        part = report[key]
        rgb, luma = (number(part[name], ".2f") for name in ("psnr_rgb", "psnr_luma"))
        ssim, flip = number(part["ssim"], ".4f"), number(part["flip"], ".4f")
        relative = number(part["rel_mse"], ".5f")
        lines.append(f"{title:17}{rgb:>7} dB{luma:>8} dB{ssim:>10}{flip:>10}{relative:>10}")
    away = report["away_from_edges"]
    kind = {"surfaces": "surfaces' edges", "luma": "steps of luma"}[away["edges_from"]]
    share = 100.0 * away["share_of_pixels"]
    lines.append(
        f"{share:.1f} % of the pixels are away from edges "
        f"(more than {away['radius_pixels']} px from {kind})"
    )
    return "\n".join(lines)
