# SPDX-License-Identifier: GPL-3.0-or-later
"""Ratios of the relighting benchmark."""

from __future__ import annotations

import pytest

from benchmarks.relight_figures import Bound, cycles_seconds, figures, per_sample

# A renderer of 1 s and 0.5 s a sample, whose noise falls by 3.01 dB for twice the samples.
SECONDS = {"1": 1.5, "4": 3.0, "16": 9.0}
NOISE = 3.0102999566
ERRORS = {
    **{f"cycles-{n}": {"whole": 30.0 + NOISE * k} for n, k in ((1, 0), (4, 2), (16, 4))},
    "two samples": {"whole": 30.0 + NOISE},
    "sixty-four samples": {"whole": 30.0 + 6 * NOISE},
    "worse than any": {"whole": 12.0},
}


@pytest.mark.parametrize(
    ("ours", "expected"),
    [("two samples", 2.0), ("sixty-four samples", 33.0), ("worse than any", 1.5)],
)
def test_cycles_time_for_our_error(ours: str, expected: float) -> None:
    assert cycles_seconds(SECONDS, ERRORS, ours) == pytest.approx(expected, rel=1e-6)


def test_a_further_sample_costs_the_slope() -> None:
    assert per_sample({"1": 5.0, "16": 24.5}) == pytest.approx(1.3)


def test_a_bound_is_met_from_its_ratio_on() -> None:
    assert Bound("a", 0.01, 1.0, 100.0).met
    assert not Bound("a", 0.011, 1.0, 100.0).met
    assert "MISSED" in str(Bound("a", 0.011, 1.0, 100.0))


def test_every_way_of_shadowing_has_its_bounds() -> None:
    edit = {
        "relume": {kind: {"shape_s": 0.05, "color_s": 0.005} for kind in ("map", "traced")},
        "eevee": {"first_s": 5.0, "sample_s": 1.0},
        "cycles_same_s": {"map": 6.0, "traced": 4.0},
    }
    ratios = [round(bound.ratio) for bound in figures(edit)]
    assert ratios == [120, 100, 20, 1200, 80, 100, 20, 800]
    assert [bound.met for bound in figures(edit)] == [True] * 4 + [False, True, True, False]
