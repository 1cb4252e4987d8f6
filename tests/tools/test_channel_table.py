# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's table of channels is the one that the code has."""

from __future__ import annotations

from pathlib import Path

from tools.channel_table import channel_table


def test_the_manual_has_the_table() -> None:
    page = Path("docs/caching.md").read_text(encoding="utf-8")
    assert channel_table() in page, "put what python -m tools.channel_table prints into the page"
