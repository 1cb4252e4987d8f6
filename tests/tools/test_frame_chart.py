# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's chart is the session's own graph."""

from __future__ import annotations

from pathlib import Path

from tools.frame_chart import frame_chart

PAGE = Path(__file__).parents[2] / "docs" / "relighting.md"


def test_the_page_has_the_chart() -> None:
    chart = frame_chart()
    assert chart in PAGE.read_text(encoding="utf-8"), (
        "put what python -m tools.frame_chart prints into the page"
    )
