# SPDX-License-Identifier: GPL-3.0-or-later
"""What docs/accuracy.md says around its tables, and the causes of what is short."""

from __future__ import annotations

from dataclasses import dataclass

from .accuracy_cases import LIGHTS
from .accuracy_figures import LEAST_PSNR

HEAD = """# Accuracy

Relume's direct light beside Cycles', for every kind of light on every kind of lobe. `make
accuracy` makes this page and the contact sheet `out/accuracy/sheet.png`.

A pair of a light and a lobe is *within* when its PSNR is {psnr:.0f} dB or more and its mean
within {mean:.0f} per cent of Cycles', away from the edges of surfaces (2 pixels). The PSNR is of
the display-encoded picture at the exposure that brings its brightest pixel to white, so that
nothing is clipped and highlights count in full. Relume takes {counts} samples, with traced
shadows, the exact way; maps, the fast one, have errors of their own. Cycles takes two renders of
128 samples with other seeds (64 of lights without an extent), without denoiser; a quarter of
their squared difference is the reference's own error, and where that is within 3 dB of what was
measured, the pair is *hidden* by it. Cells are 32 pixels wide, and both programs look through a
filter of a hundredth of a pixel: the figures are of shading, not of edges.
"""


@dataclass(frozen=True)
class Cause:
    """Why pairs are short, and what is planned.

    Attributes:
        letter: by which the tables name it.
        why: the cause, and how it was found.
        plan: what would mend it.
    """

    letter: str
    why: str
    plan: str


CAUSES = {
    "world": Cause(
        "W",
        "Noise of the world's 256 directions, which all pixels share and whose shadows are "
        "looked at in four spots each, on lobes that rays don't serve (translucent, sheen), and "
        "of Cycles' 256 samples, whose halves agree by chance in nearly black cells. With 1,024 "
        "directions sheen goes from 47 to 52 dB; four times as many rays took glossy lobes from "
        "48 to 55 dB, and are what is measured here",
        "directions of each pixel's own for wide lobes too"),
    "mirror": Cause(
        "M",
        "What a mirror shows of a light has hard edges, and one pixel on the wrong side of one "
        "is worth 30 dB here; where occluders hide a part of the light, the mirror shows it in "
        "sixteenths of a cell. All of the error is in pixels at these edges",
        "a ray along the mirrored direction beside those to the spots"),
    "narrow": Cause(
        "N",
        "Of a narrow lobe's highlight the shadow's outline comes in sixteenths of a cell, "
        "blurred by a spot's width. All of the error is in pixels at that outline",
        "a ray along the mirrored direction beside those to the spots"),
    "hard": Cause(
        "H",
        "Single pixels whose centre lies within a few thousandths of a pixel of a hard shadow's "
        "edge: the shares of both programs' samples on its sides differ",
        "none: the edges are where Cycles has them"),
    "speck": Cause(
        "S",
        "A narrow highlight on a ball is one to three pixels here. Seen from their centres "
        "alone, the 64 cells of a square light add up to Cycles' highlight (+0.3 %); but each "
        "sample sees its cell from a place of its own, and within the hundredth of a pixel that "
        "both programs filter over, the ball's normal turns by a tenth of such a lobe's width. "
        "With 256 samples the mean's error goes from -2.4 to +0.6 %, from +2.3 to +1.1 %",
        "all cells from each place, where a highlight is narrower than a pixel"),
    "cone": Cause(
        "C",
        "At the rim of a soft spot's cone a ball's highlights are up to a quarter too dark, with "
        "256 samples by less (50 dB, -1.4 %): likely what 16 spots of a cell, weighed by the "
        "lobe, make of the cone there",
        "weigh the cone within the lobe as its mass is weighed"),
    "digits": Cause(
        "D",
        "Cycles' own digits: it takes one minus a cosine's square in float32, whose step "
        "(1.2e-7) is a fiftieth of so narrow a lobe's squared alpha, and a normal's length is "
        "off by as much: up to 3 % at the highlight's peak",
        "none: Relume takes the sine, which keeps its digits"),
    "reference": Cause(
        "R",
        "Cycles' 256 samples of a narrow coat over a matte base: one pixel is all there is of "
        "the highlight, and 21 % below that of 8,192 samples, from which Relume is 6 % away",
        "none: more samples of Cycles"),
    "horizon": Cause(
        "O",
        "Only a wide sun's rim is above these facets' horizon: one to three of its 64 points, "
        "and few of Cycles' samples. With 256 points it is 34 dB, where Cycles' noise is 35 dB",
        "points of the part of a sun that is above the horizon"),
}  # fmt: skip


def cause_of(setup: str, light: str, lobe: str, psnr: float) -> str:
    """The key of CAUSES for a pair that is short, by what was found of such pairs."""
    kind, settings = LIGHTS[light]
    hard = not any(settings.get(s, 0.0) for s in ("angle", "shadow_soft_size", "size"))
    only_mean = psnr >= LEAST_PSNR
    coated = lobe.startswith(("plastic", "coat"))
    found = {
        "world": kind == "WORLD",
        "digits": hard and only_mean and "0.05" in lobe,
        "hard": hard,
        "mirror": "mirror" in lobe,
        "horizon": kind == "SUN" and setup.startswith("furnace"),
        "cone": kind == "SPOT" and lobe == "two glossy",
        "reference": only_mean and coated,
        "speck": only_mean,
    }
    return next((key for key, is_it in found.items() if is_it), "narrow")
