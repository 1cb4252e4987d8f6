# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/accuracy.md and its contact sheet, from what `benchmarks.accuracy_run` left."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from statistics import median

import numpy as np

from tools.contact_sheet import Cell, Row, draw_sheet
from tools.metrics import encode_srgb

from .accuracy_cases import LIGHTS
from .accuracy_figures import LARGEST_MEAN, LEAST_PSNR, Figures
from .accuracy_scenes import SETUPS
from .accuracy_text import CAUSES, HEAD, cause_of

# By set-up, light and lobe's number.
Table = Mapping[str, Mapping[str, Mapping[int, Figures]]]


def write(path: Path, table: Table, lobes: list[str], counts: list[int]) -> None:
    """Write the page."""
    lines = [HEAD.format(psnr=LEAST_PSNR, mean=100.0 * LARGEST_MEAN, counts=_and(counts))]
    lines += _summary(table, counts)
    missing = {
        setup: [light for light in LIGHTS if light not in table.get(setup, {})] for setup in SETUPS
    }
    lines += [
        f"Of {setup}, not measured here: {'; '.join(lights)}.\n"
        for setup, lights in missing.items()
        if lights
    ]
    lines += ["## What is short, and why", ""]
    lines += _shorts(table, lobes, max(counts))
    for setup, lights in table.items():
        if not lights:
            continue
        lines += _pairs(setup, lights, lobes, max(counts))
    path.write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


def _and(counts: list[int]) -> str:
    return " and ".join(map(str, sorted(counts)))


def _all(table: Table) -> list[tuple[str, str, int, Figures]]:
    return [
        (setup, light, lobe, figures)
        for setup, lights in table.items()
        for light, found in lights.items()
        for lobe, figures in found.items()
    ]


def _summary(table: Table, counts: list[int]) -> list[str]:
    about = (
        "A + is with occluders. Of each number of samples: how many pairs are within both bounds, "
        "how many are short, for how many Cycles' own noise hides which, and the median PSNR."
    )
    lines = [
        "## By set-up", "", about, "",
        "| set-up | pairs | "
        + " | ".join(f"{n}: within, short, hidden | median" for n in sorted(counts)) + " |",
        "| --- " * (2 + 2 * len(counts)) + "|",
    ]  # fmt: skip
    for setup in table:
        found = [f for s, _, _, f in _all(table) if s == setup]
        if not found:
            continue
        cells = []
        for n in sorted(counts):
            verdicts = [f.judge(n) for f in found]
            parts = [str(verdicts.count(v)) for v in ("ok", "short", "noise")]
            cells += [", ".join(parts), f"{_number(median(f.psnr[n] for f in found))} dB"]
        lines.append(f"| {setup} | {len(found)} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def _number(psnr: float) -> str:
    return ">99" if psnr > 99.0 or math.isinf(psnr) else f"{psnr:.0f}"


def _shorts(table: Table, lobes: list[str], count: int) -> list[str]:
    """One line for each cause, with how many pairs it explains and the worst of them."""
    by_cause: dict[str, list[tuple[str, str, int, Figures]]] = {}
    for setup, light, lobe, figures in _all(table):
        if figures.judge(count) == "short":
            key = cause_of(setup, light, lobes[lobe - 1], figures.psnr[count])
            by_cause.setdefault(key, []).append((setup, light, lobe, figures))
    if not by_cause:
        return [f"Nothing is, at {count} samples.", ""]
    lines = [
        f"At {count} samples; the letters are those beside the pairs below:", "",
        "| | cause | pairs | worst | plan |", "| --- | --- | --- | --- | --- |",
    ]  # fmt: skip
    for key, cause in CAUSES.items():
        pairs = by_cause.get(key, [])
        if not pairs:
            continue
        setup, light, lobe, figures = min(pairs, key=lambda pair: pair[3].psnr[count])
        worst = (
            f"{setup}: {light} on {lobes[lobe - 1]}, {_number(figures.psnr[count])} dB, "
            f"{100.0 * figures.mean[count]:+.1f} %"
        )
        lines.append(f"| {cause.letter} | {cause.why} | {len(pairs)} | {worst} | {cause.plan} |")
    return [*lines, ""]


def _pairs(
    setup: str, lights: Mapping[str, Mapping[int, Figures]], lobes: list[str], count: int
) -> list[str]:
    about = (
        f"PSNR in dB at {count} samples, and the mean's error in per cent where it is half a per "
        "cent or more. **Bold**: short, for the reason of that letter. (In brackets): Cycles' "
        "noise hides it. -: no light."
    )
    lines = [
        f"## All pairs: {setup}", "", about, "",
        "| light | " + " | ".join(lobes) + " |", "| --- " * (1 + len(lobes)) + "|",
    ]  # fmt: skip
    for light, found in lights.items():
        cells = []
        for lobe in range(1, len(lobes) + 1):
            if lobe not in found:
                cells.append("-")
                continue
            figures = found[lobe]
            text = _number(figures.psnr[count])
            if abs(figures.mean[count]) >= 0.005:
                text += f" {100.0 * figures.mean[count]:+.1f}"
            verdict = figures.judge(count)
            if verdict == "short":
                key = cause_of(setup, light, lobes[lobe - 1], figures.psnr[count])
                text = f"**{text}** {CAUSES[key].letter}"
            cells.append(f"({text})" if verdict == "noise" else text)
        lines.append(f"| {light} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def draw(path: Path, pictures: Mapping[str, Mapping[str, Path]], count: int) -> None:
    """Draw Cycles, Relume and their difference for each light of each set-up."""
    rows = []
    for setup, lights in pictures.items():
        cells = []
        for light, file in lights.items():
            with np.load(file) as data:
                truth = 0.5 * (data["half 0"] + data["half 1"])
                relit, lobe, edge = data[f"relit {count}"], data["lobe"], data["edge"]
            scale = np.zeros((*lobe.shape, 1))
            for number in np.unique(lobe[lobe > 0]):
                inside = (lobe == number) & ~edge
                peak = float(truth[inside].max()) if inside.any() else 0.0
                scale[lobe == number] = 1.0 / peak if peak > 0.0 else 0.0
            shown = [encode_srgb(picture * scale) for picture in (truth, relit)]
            apart = np.clip(8.0 * np.abs(shown[0] - shown[1]), 0.0, 1.0)
            cells.append(Cell(np.concatenate([*shown, apart]), light))
        rows.append(Row(setup, cells))
    sheet = draw_sheet(
        "Accuracy",
        "From the top of each: the difference times eight, Relume, Cycles; each lobe to its "
        "brightest.",
        rows, column=200)  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    sheet.save(path)
