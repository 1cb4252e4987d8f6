# SPDX-License-Identifier: GPL-3.0-or-later
"""The argument that says how fine a bake is."""

from __future__ import annotations

import argparse

from .caching.presets import DEFAULT_PRESET, PRESETS, Preset


def add_preset(parser: argparse.ArgumentParser, default: Preset | None) -> None:
    """How fine a bake is; a default of None means as the cache was begun."""
    note = default or f"as the cache was begun, else {DEFAULT_PRESET}"
    parser.add_argument(
        "--preset",
        choices=tuple(PRESETS),
        default=default,
        help=f"how fine the bake is (default: {note})",
    )
