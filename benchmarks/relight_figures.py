# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of `benchmarks.relight`, and the bounds that they are held to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

# How many times faster an edit has to be.
SHAPE_OVER_CYCLES = 100.0
SHAPE_OVER_EEVEE_PICTURE = 50.0
SHAPE_OVER_EEVEE_SAMPLE = 10.0
COLOR_OVER_CYCLES = 1000.0


@dataclass(frozen=True)
class Bound:
    """One ratio and what it has to be at least."""

    name: str
    ours_s: float
    theirs_s: float
    least: float

    @property
    def ratio(self) -> float:
        """How many times faster."""
        return self.theirs_s / self.ours_s

    @property
    def met(self) -> bool:
        """Whether it is fast enough."""
        return self.ratio >= self.least

    def __str__(self) -> str:
        verdict = "met" if self.met else "MISSED"
        return (
            f"{self.name}: {1e3 * self.ours_s:.1f} ms beside {self.theirs_s:.2f} s, "
            f"{self.ratio:.0f} times faster (wanted {self.least:g}: {verdict})"
        )


def per_sample(seconds: Mapping[str, float]) -> float:
    """Seconds for each further sample, from the fewest and the most samples."""
    counts = sorted(map(int, seconds))
    low, high = counts[0], counts[-1]
    return (seconds[str(high)] - seconds[str(low)]) / (high - low)


def cycles_seconds(
    seconds: Mapping[str, float], errors: Mapping[str, Mapping[str, float]], ours: str
) -> float:
    """Seconds that Cycles needs for the PSNR of the picture `ours`.

    PSNR grows with the logarithm of the samples; between the measured counts it is interpolated,
    and beyond the last extrapolated by the noise's law, 3.01 dB for twice the samples. One
    sample is the least that Cycles can do.
    """
    counts = np.array(sorted(map(int, seconds)), dtype=np.float64)
    psnr = np.array([errors[f"cycles-{int(n)}"]["whole"] for n in counts])
    wanted = errors[ours]["whole"]
    if wanted > psnr[-1]:
        samples = counts[-1] * 2.0 ** ((wanted - psnr[-1]) / (20.0 * np.log10(np.sqrt(2.0))))
    else:
        samples = 2.0 ** np.interp(wanted, psnr, np.log2(counts))
    slope, fixed = np.polyfit(counts, [seconds[str(int(n))] for n in counts], 1)
    return float(max(fixed, 0.0) + slope * samples)


def figures(edit: Mapping[str, Any]) -> list[Bound]:
    """Every bound, for each way of finding shadows."""
    eevee = edit["eevee"]
    bounds = []
    for kind, relume in edit["relume"].items():
        cycles = edit["cycles_same_s"][kind]
        shape, color = relume["shape_s"], relume["color_s"]
        bounds += [
            Bound(f"light edit ({kind}) and Cycles", shape, cycles, SHAPE_OVER_CYCLES),
            Bound(
                f"light edit ({kind}) and EEVEE's first sample",
                shape, eevee["first_s"], SHAPE_OVER_EEVEE_PICTURE,
            ),
            Bound(
                f"light edit ({kind}) and EEVEE's further samples",
                shape, eevee["sample_s"], SHAPE_OVER_EEVEE_SAMPLE,
            ),
            Bound(f"colour edit ({kind}) and Cycles", color, cycles, COLOR_OVER_CYCLES),
        ]  # fmt: skip
    return bounds


def describe_costs(rows: Sequence[Mapping[str, Mapping[str, Any]]]) -> str:
    """A table of edits by the number of lights and triangles, milliseconds."""
    lines = [
        "| lights | triangles | shadows | light edit, ms | coarse, ms | colour, ms | 16 samples, s |",  # noqa: E501
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        for kind, cost in row.items():
            lines.append(
                f"| {cost['lights']} | {cost['triangles']:,} | {kind} | "
                f"{1e3 * cost['shape_s']:.0f} | {1e3 * cost['coarse_s']:.0f} | "
                f"{1e3 * cost['color_s']:.1f} | {cost['refined_s']['16']:.2f} |"
            )
    return "\n".join(lines)
