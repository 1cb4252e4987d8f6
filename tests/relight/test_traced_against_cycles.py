# SPDX-License-Identifier: GPL-3.0-or-later
"""Traced shadows against Cycles: each kind of light, and lamps that touch what they light."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from . import test_against_cycles
from .test_against_cycles import CASES, DIFFUSE, build, compare, cycles_picture, relit_picture

blend = test_against_cycles.blend
pytestmark = pytest.mark.usefixtures("gpu_context")

# A lamp half sunk into the floor, and one into the top of the ball.
SUNK: dict[str, tuple[str, dict[str, Any], tuple[float, float, float]]] = {
    "point in the floor": ("POINT", {"energy": 200.0, "shadow_soft_size": 0.5}, (1.4, -0.8, 0.2)),
    "ball in the floor": (
        "POINT",
        {"energy": 200.0, "shadow_soft_size": 0.5, "use_soft_falloff": False},
        (1.4, -0.8, 0.6),
    ),
    "wide spot in the ball": (
        "SPOT", {"energy": 200.0, "shadow_soft_size": 0.4, "spot_size": 2.8}, (0.0, -0.2, 1.8),
    ),
}  # fmt: skip


def is_hard(kind: str, settings: dict[str, Any]) -> bool:
    return not (kind == "AREA" or settings.get("shadow_soft_size") or settings.get("angle"))


@pytest.mark.parametrize("name", CASES)
def test_each_light(name: str, blend: Any, tmp_path: Path) -> None:
    kind, settings = CASES[name]
    build(blend, kind, settings, DIFFUSE)
    hard = is_hard(kind, settings)
    ratio, psnr = compare(blend, DIFFUSE, tmp_path / "cycles.exr", hard, traced=True)
    # Half a per cent; 32 points of a light and 64 samples of Cycles are what is left. Maps reach
    # the same where a shadow's edge is soft, and 16 dB less where texels draw a hard one.
    assert ratio == pytest.approx(1.0, abs=0.005)
    # A single pixel of a hard edge that falls on the other side of its centre is worth 48 dB.
    assert psnr > 47.0, f"{psnr:.1f} dB"


@pytest.mark.parametrize("name", SUNK)
def test_lamps_that_touch(name: str, blend: Any, tmp_path: Path) -> None:
    kind, settings, place = SUNK[name]
    build(blend, kind, settings, DIFFUSE)
    blend.objects["Light"].location = place
    reference = cycles_picture(blend, tmp_path / "cycles.exr", 256)[..., :3]
    # Near a lamp 1 / t^2 is steep: 32 points leave 38 dB, 128 leave 60 dB against 1,024 samples.
    relit, hit = relit_picture(blend, DIFFUSE, 128, traced=True)
    error = ((relit - reference)[hit] / reference.max()) ** 2
    assert relit[hit].mean() == pytest.approx(reference[hit].mean(), rel=0.01)
    # Maps, whose turned disks all receivers share, have 29 to 35 dB here.
    assert -10.0 * np.log10(error.mean()) > 50.0
