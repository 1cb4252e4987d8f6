# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of one light in one set-up, for each lobe: what `benchmarks.accuracy` writes down."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tools.metrics import encode_srgb

# The bounds.
LEAST_PSNR, LARGEST_MEAN = 45.0, 0.01
# Fewer pixels than these say nothing.
_FEWEST_PIXELS = 30
# A lobe that a light brings less than this share of the set-up's brightest is not lit by it.
_DARK = 1e-4


@dataclass(frozen=True)
class Figures:
    """Of one lobe under one light.

    Attributes:
        psnr: decibels, of the display-encoded picture at the exposure that brings its brightest
            pixel to white, by number of samples.
        noise: decibels: the same of the reference against itself without noise, estimated.
        mean: relative error of the mean radiance, by number of samples.
        mean_noise: its standard error in the reference.
    """

    psnr: dict[int, float]
    noise: float
    mean: dict[int, float]
    mean_noise: float

    def judge(self, count: int) -> str:
        """ "ok", "short", or "noise" where the reference is not good enough to tell."""
        within = abs(self.mean[count]) <= LARGEST_MEAN + 2.0 * self.mean_noise
        if within and self.psnr[count] >= LEAST_PSNR:
            return "ok"
        # Noise that reaches within 3 dB of what was measured is half of it.
        if within and self.noise < self.psnr[count] + 3.0:
            return "noise"
        return "short"


def _psnr(mean_squared: float) -> float:
    return math.inf if mean_squared <= 0.0 else -10.0 * math.log10(mean_squared)


def figures(path: Path, lobes: int) -> dict[int, Figures]:
    """By lobe number; lobes that the light does not reach are left out."""
    with np.load(path) as file:
        data = dict(file)
    halves = [data[f"half {n}"].astype(np.float64) for n in range(2)]
    truth = 0.5 * (halves[0] + halves[1])
    relit = {int(k.split()[1]): v for k, v in data.items() if k.startswith("relit")}
    seen = (data["lobe"] > 0) & ~data["edge"]
    brightest = truth[seen].max() if seen.any() else 0.0
    found = {}
    for lobe in range(1, lobes + 1):
        inside = (data["lobe"] == lobe) & ~data["edge"]
        peak = float(truth[inside].max()) if inside.any() else 0.0
        if inside.sum() < _FEWEST_PIXELS or peak <= _DARK * brightest:
            continue
        shown = encode_srgb(truth[inside] / peak)
        apart = [encode_srgb(half[inside] / peak) for half in halves]
        total = float(truth[inside].mean())
        means = [float(half[inside].mean()) for half in halves]
        found[lobe] = Figures(
            psnr={
                n: _psnr(float(np.mean((encode_srgb(v[inside] / peak) - shown) ** 2)))
                for n, v in relit.items()
            },
            # Of the mean of both halves: a quarter of their squared difference.
            noise=_psnr(float(np.mean((apart[0] - apart[1]) ** 2)) / 4.0),
            mean={n: float(v[inside].mean()) / total - 1.0 for n, v in relit.items()},
            mean_noise=abs(means[0] - means[1]) / 2.0 / total,
        )
    return found
