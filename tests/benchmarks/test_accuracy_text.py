# SPDX-License-Identifier: GPL-3.0-or-later
"""Every pair that may be short has a cause, and every cause a letter of its own."""

from __future__ import annotations

import pytest

from benchmarks.accuracy_cases import LIGHTS, LOBES
from benchmarks.accuracy_figures import LEAST_PSNR
from benchmarks.accuracy_scenes import SETUPS
from benchmarks.accuracy_text import CAUSES, cause_of


def test_causes_have_letters_of_their_own() -> None:
    assert len({cause.letter for cause in CAUSES.values()}) == len(CAUSES)
    assert all(len(cause.letter) == 1 for cause in CAUSES.values())


@pytest.mark.parametrize("setup", SETUPS)
def test_every_pair_has_one(setup: str) -> None:
    found = {
        cause_of(setup, light, lobe, LEAST_PSNR + above)
        for light in LIGHTS
        for lobe in LOBES
        for above in (-1.0, 1.0)
    }
    assert found <= CAUSES.keys()


@pytest.mark.parametrize(
    ("pair", "cause"),
    [
        (("sphere", "world, constant", "metal 0.05", 39.0), "world"),
        (("plane+", "point", "Lambert", 31.0), "hard"),
        (("plane", "point", "metal 0.05", 60.0), "digits"),
        (("plane+", "area, disk", "metal 0 (mirror)", 40.0), "mirror"),
        (("plane+", "area, disk", "metal 0.05", 39.0), "narrow"),
        (("sphere", "area, square", "metal 0.05", 55.0), "speck"),
        (("sphere", "point, no diffuse", "plastic 0.05", 71.0), "reference"),
        (("sphere", "spot, sphere", "two glossy", 45.1), "cone"),
        (("furnace", "sun, 60 degrees", "translucent", 29.0), "horizon"),
    ],
)
def test_cause_of(pair: tuple[str, str, str, float], cause: str) -> None:
    assert cause_of(*pair) == cause
