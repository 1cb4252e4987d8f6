# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of what a light costs at each pixel runs."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import relight_cost


def test_every_case_is_drawn_and_timed(gpu_context: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relight_cost, "SIZE", 32)
    costs, machine = relight_cost.measure(1)
    assert len(costs) == 8
    assert min(cost.nanoseconds for cost in costs) > 0.0
    # A point's shadow is read, and nothing else is.
    plain, shadowed = costs[0], costs[1]
    assert shadowed.bytes_moved == plain.bytes_moved + 4
    assert np.isfinite(list(machine.values())).all()
