# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences in panels: Blender's labels do not wrap by themselves."""

from __future__ import annotations

import textwrap
from typing import Any

# Mean width of a letter in Blender's interface font at a scale of 1, in pixels.
CHARACTER_WIDTH = 6.2
# What a line in a box loses to margins and its icon, in the same unit; and the fewest letters
# that it still makes sense to break a line at.
MARGIN = 65.0
MOST_NARROW = 16


def characters_across(context: Any) -> int:
    """How many letters a line in a box of the region that is drawn has room for."""
    room = context.region.width / context.preferences.system.ui_scale - MARGIN
    return max(MOST_NARROW, int(room / CHARACTER_WIDTH))


def draw_text(column: Any, text: str, icon: str, characters: int) -> None:
    """A sentence in lines of at most so many letters."""
    for line in textwrap.wrap(text, characters):
        column.label(text=line, icon=icon)
        icon = "BLANK1"
