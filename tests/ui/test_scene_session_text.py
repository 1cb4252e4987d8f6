# SPDX-License-Identifier: GPL-3.0-or-later
"""What the status line says about the cache."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from addon.corrmap.correspondence import Coverage
from addon.ui.scene_session import SceneSession


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (0.0, "all of the picture is in the cache"),
        (1e-7, "less than 0.01 % of the picture is not in the cache"),
        (0.0123, "1.23 % of the picture is not in the cache"),
    ],
)
def test_holes_are_told_however_few(share: float, words: str) -> None:
    shown: Any = SimpleNamespace(
        session=SimpleNamespace(coverage=Coverage(10**7, share, 0.0)), stale=("it is stale",)
    )
    assert SceneSession.describe(shown) == f"{words}; it is stale"
