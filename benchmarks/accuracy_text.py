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
one, because both programs look through the pixels' centres. Its shadows are traced, the exact way;
maps, the fast one, have errors of their own. Cycles takes two renders of 128 samples with other
seeds, without denoiser; a quarter of their squared difference is the reference's own error, and
where that is within 3 dB of what was measured, the pair is *hidden* by it. Cells are 32 pixels
wide: the figures are of shading, not of edges.
"""


@dataclass(frozen=True)
class Cause:
    """Why pairs are short, and what is planned."""

    why: str
    plan: str


CAUSES = {
    "world": Cause(
        "Noise of the world's 128 rays of glossy lobes and of its 256 directions, whose shadows "
        "are looked at in four spots each, beside that of Cycles' own picture",
        "more rays where lobes are rough",
    ),
    "mirror": Cause(
        "What a mirror shows of a light has hard edges, and one pixel on the wrong side of one "
        "is worth 30 dB here; in shadow it shows the light in sixteenths of a cell",
        "more samples: the parts are as small as there are many"),
    "penumbra": Cause(
        "Of a narrow lobe's highlight the shadow's outline comes in sixteenths of a cell; other "
        "penumbrae are those of 16 points a sample",
        "more samples"),
    "hard": Cause(
        "Single pixels flip at the edges of hard shadows: one of a square's 700 is worth 31 dB",
        "none: the edges are within a pixel of Cycles'"),
    "speck": Cause(
        "A narrow highlight on a ball is two or three pixels here; each sample sees its cell of "
        "the light from a place of its own in the pixel, where the normal is another",
        "more samples"),
    "terminator": Cause(
        "Where a ball's facets turn away before its smooth normals do, Cycles starts shadow rays "
        "above the facets (its Shadow Terminator Geometry Offset): one or two pixels of a ball",
        "start rays there too"),
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
    narrow = any(f"{r}" in lobe for r in ("0.05", "0.1", "0.2", "0.3", "coat", "glossy"))
    if not setup.startswith("sphere"):
        return "hard" if hard else "penumbra"
    return "speck" if narrow and not hard else "terminator"
