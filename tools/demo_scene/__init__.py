# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the demo's scene, a small furnished room, from nothing but code.

`build` is what the demo calls; `python -m tools.demo_scene OUT.blend` writes the file alone.
"""

from __future__ import annotations

from .room import LIGHT_EDITS, SHOT_FRAMES, build

__all__ = ["LIGHT_EDITS", "SHOT_FRAMES", "build"]
