# SPDX-License-Identifier: GPL-3.0-or-later
"""The colours of a placement's picture; told apart by the colour-blind too, by lightness."""

from __future__ import annotations

WELL, COARSE, MISSED = "#2a9d4a", "#e9a800", "#e3142d"
CUBE, SINGLE, VIEW = "#1f5fd0", "#7b2fbe", "#111111"
WALL, CREASE, EMPTY = "#444444", "#d8d8d8", "#a9bfe0"
