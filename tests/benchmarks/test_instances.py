# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of repeated meshes runs, and compares what it says."""

from __future__ import annotations

import numpy as np
import pytest

from addon.errors import InputError
from addon.scene import copies_finder
from benchmarks import instances


@pytest.fixture
def few_are_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(copies_finder, "LEAST_SPARED", 1)


def test_few_copies_are_refused(gpu_context: None) -> None:
    geometry = instances.forest(3, 600)
    with pytest.raises(InputError, match="more copies"):
        instances.put(geometry, instances.view_of((8, 8), 0), "instanced")


@pytest.mark.usefixtures("few_are_enough")
def test_both_ways_draw_one_forest(gpu_context: None) -> None:
    from addon.corrmap.visible_surface import VisibleSurfacePass

    geometry = instances.forest(12, 7000)
    assert len(geometry) == 12 * 7000 + 2
    assert [len(copies) for copies in geometry.copies] == [12]
    view = instances.view_of((48, 36), 0)
    found = []
    for way in instances.WAYS:
        buffer = instances.put(geometry, view, way)
        assert (buffer.copies is None) == (way == "flattened")
        found.append(VisibleSurfacePass(buffer).draw(view).scene_triangles())
    assert (found[0] == found[1]).mean() > 0.99
    assert (found[0] >= 0).mean() > 0.2
    assert len(np.unique(geometry.object_id[found[0][found[0] >= 0]])) > 3


@pytest.mark.usefixtures("few_are_enough")
def test_every_pass_is_timed(gpu_context: None) -> None:
    times = instances.times(12, 7000, (24, 18), 1)
    assert len(times) == 4
    assert all(set(ways) == set(instances.WAYS) for ways in times.values())
    assert min(min(ways.values()) for ways in times.values()) > 0.0
