# SPDX-License-Identifier: GPL-3.0-or-later
"""Which way of finding shadows "auto" is."""

from __future__ import annotations

import numpy as np
import pytest

from addon.relight.shadows.shadow_frustum import ShadowSettings
from addon.scene.light import Light

LAMP = Light("Lamp", "POINT", np.eye(4), 1.0, np.ones(3))


@pytest.mark.parametrize(
    ("method", "in_software", "traces"),
    [
        ("auto", True, True),
        ("auto", False, False),
        ("map", True, False),
        ("traced", False, True),
    ],
)
def test_auto_is_the_faster_way(method: str, in_software: bool, traces: bool) -> None:
    settings = ShadowSettings(method=method, resolution=512)  # type: ignore[arg-type]
    settled = settings.settled(in_software=in_software)
    assert settled.traces(LAMP) is traces
    assert settled.resolution == 512
    assert settled.method != "auto"
