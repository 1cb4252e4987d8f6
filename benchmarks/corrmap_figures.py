# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of `benchmarks.corrmap`, and the bounds that it is held to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .relight_figures import Bound

# How many times faster than EEVEE's one sample a camera move has to be.
MOVE_OVER_EEVEE = 30.0

# The passes of a camera move, in the order in which they run.
PASSES = ("visible surface", "correspondence", "gather", "lights", "world")


def move_bounds(rows: Sequence[Mapping[str, Any]], triangles: int) -> list[Bound]:
    """What a camera move is held to, in the scene whose row asked for so many triangles; none where
    EEVEE did not render it."""
    return [
        Bound(
            "camera move and EEVEE's first sample", row["move_s"], row["eevee_s"], MOVE_OVER_EEVEE
        )
        for row in rows
        if row["asked"] == triangles and "eevee_s" in row
    ]


def growth(rows: Sequence[Mapping[str, Any]]) -> float:
    """How many times longer a move takes with the most cameras than with the fewest."""
    by_cameras = sorted(rows, key=lambda row: row["cameras"])
    return float(by_cameras[-1]["move_s"] / by_cameras[0]["move_s"])


def describe_moves(rows: Sequence[Mapping[str, Any]]) -> str:
    """Camera moves by cameras and triangles, milliseconds, with what each pass takes of it, and how
    many times longer other renderers take."""
    others = [name for name in ("eevee_s", "cycles_s") if any(name in row for row in rows)]
    head = ["cameras", "triangles", "holes", "camera move, ms", *PASSES]
    head += [f"{'EEVEE' if name == 'eevee_s' else 'Cycles'}, s (times)" for name in others]
    lines = [f"| {' | '.join(head)} |", f"|{' --- |' * len(head)}"]
    for row in rows:
        cells = [
            f"{row['cameras']}",
            f"{row['triangles']:,}",
            f"{100 * row['hole_fraction']:.1f} %",
        ]
        cells.append(f"{1e3 * row['move_s']:.0f}")
        cells += [f"{1e3 * row['passes_s'].get(name, 0.0):.0f}" for name in PASSES]
        cells += [
            f"{row[name]:.2f} ({row[name] / row['move_s']:.0f})" if name in row else ""
            for name in others
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)
