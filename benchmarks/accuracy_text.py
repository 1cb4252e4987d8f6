# SPDX-License-Identifier: GPL-3.0-or-later
"""What docs/accuracy.md says around its tables, and the causes of what is short."""

from __future__ import annotations

from dataclasses import dataclass

from .accuracy_cases import LIGHTS

HEAD = """# Accuracy

Relume's direct light beside Cycles', for every kind of light on every kind of lobe. `make accuracy`
makes this page and the contact sheet `out/accuracy/sheet.png`.

A pair of a light and a lobe is *within* when its PSNR is {psnr:.0f} dB or more and its mean within
{mean:.0f} per cent of Cycles', away from the edges of surfaces (2 pixels). The PSNR is of the
display-encoded picture at the exposure that brings its brightest pixel to white, so that nothing is
clipped and highlights count in full. Relume takes {counts} samples; lights without an extent take
one, because both programs look through the pixels' centres. Cycles takes two renders of 128 samples
with other seeds, without denoiser; a quarter of their squared difference is the reference's own
error, and where that is within 3 dB of what was measured, the pair is *hidden* by it. Cells are 32
pixels wide: the figures are of shading, not of edges.
"""


@dataclass(frozen=True)
class Cause:
    """Why pairs are short, and what is planned."""

    why: str
    plan: str


CAUSES = {
    "world": Cause(
        "The world is sampled by direction, all pixels alike: steps of its shadows, and at the "
        "rims of balls; not followed further yet",
        "more samples, then find out",
    ),
    "mirror": Cause(
        "What a mirror shows of a light has hard edges, and one pixel on the wrong side of one "
        "is worth 30 dB here",
        "none: the edges are the light's outline, within a pixel of Cycles'"),
    "penumbra": Cause(
        "Steps of soft shadows: as many as there are samples, the same in all pixels; of narrow "
        "lobes' highlights the shadow's outline in steps of a cell",
        "more samples: the error falls as their number; traced shadows refine it for each pixel"),
    "hard": Cause(
        "Edges of hard shadows lie within a texel of the shadow map, and single pixels flip",
        "traced shadows (exact), or larger maps"),
    "lamp": Cause(
        "A lamp's highlight is dimmed by the share of the lamp that a shadow hides, and a soft "
        "spot's by the share that shines on the place, wherever on the lamp that is",
        "cells of the disk that is turned to each receiver, where shadows are traced",
    ),
    "terminator": Cause(
        "Where a curved surface turns away from the light: facets against the smooth normal, "
        "within a texel of the shadow map",
        "traced shadows"),
}  # fmt: skip


def cause_of(setup: str, light: str, lobe: str) -> str:
    """The key of CAUSES for a pair that is short: by what the set-up has, so a likely one.

    Squares shade each other's borders, and the furnace's bars its patches.
    """
    kind, settings = LIGHTS[light]
    hard = not any(settings.get(s, 0.0) for s in ("angle", "shadow_soft_size", "size"))
    if kind == "WORLD":
        return "world"
    if "mirror" in lobe:
        return "mirror"
    if setup != "sphere":
        if hard:
            return "hard"
        narrow = any(f"{r}" in lobe for r in ("0.05", "0.1", "0.2", "0.3", "coat", "glossy"))
        return "lamp" if kind in ("POINT", "SPOT") and narrow else "penumbra"
    return "terminator"
