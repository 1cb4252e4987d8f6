# SPDX-License-Identifier: GPL-3.0-or-later
"""A soft superellipse as addon/glsl/lib/superellipse.glsl takes it."""

from __future__ import annotations

from ...scene.light_controls import Superellipse


def outline_sizes(outline: Superellipse) -> tuple[float, float, float, float]:
    """Half sides of the inner and of the outer outline."""
    return (
        outline.width,
        outline.height,
        outline.width + outline.width_edge,
        outline.height + outline.height_edge,
    )
