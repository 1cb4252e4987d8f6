# SPDX-License-Identifier: GPL-3.0-or-later
"""Whose views are the shot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

# Longer lists of names do not fit into a line.
MOST_NAMES = 3


@dataclass(frozen=True)
class ShotChoice:
    """Which of the scene's cameras caching cameras are placed for; all of them, if nothing else.

    Attributes:
        names: these camera objects alone.
        active: the active camera, and those that timeline markers make active.
    """

    names: tuple[str, ...] = ()
    active: bool = False


ALL_CAMERAS = ShotChoice()


def describe_shot(names: Sequence[str]) -> str:
    """What caching cameras were placed for: "8 views of 'Camera'".

    Args:
        names: of each view, the camera's.
    """
    cameras = [f"'{name}'" for name in dict.fromkeys(names)]
    number = f"{len(names)} view{'' if len(names) == 1 else 's'}"
    if len(cameras) > MOST_NAMES:
        return f"{number} of {len(cameras)} cameras"
    return f"{number} of {', '.join(cameras)}"
