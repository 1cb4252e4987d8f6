# SPDX-License-Identifier: GPL-3.0-or-later
"""Several threads give what one gives."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from addon.camplace import parallel
from addon.camplace.embree_mesh import CHUNK
from addon.camplace.rays import RayCaster
from tests.synthetic import room_with_box


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 25])
def test_every_row_is_worked_on_once(count: int) -> None:
    times = np.zeros(count, dtype=np.int64)

    def work(some: slice) -> None:
        assert 0 < some.stop - some.start <= 8
        times[some] += 1

    parallel.in_parts(work, count, 8)
    assert (times == 1).all()


def test_slow_threads_are_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parallel, "_threads", lambda: 2)
    parallel._pool.cache_clear()
    begun = threading.Event()
    done = np.zeros(2, dtype=np.bool_)

    def work(some: slice) -> None:
        if threading.current_thread() is threading.main_thread():
            begun.wait(timeout=10.0)
        else:
            begun.set()
            time.sleep(0.1)
        done[some] = True

    parallel.in_parts(work, 2, 1)
    parallel._pool.cache_clear()
    assert begun.is_set()
    assert done.all()


def test_an_error_in_a_part_is_raised() -> None:
    def work(some: slice) -> None:
        if some.start == 16:
            raise ValueError("part")

    with pytest.raises(ValueError, match="part"):
        parallel.in_parts(work, 40, 8)


def test_rays_meet_the_same_whatever_the_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(8)
    rays = RayCaster(room_with_box())
    count = 3 * CHUNK + 17
    origins = rng.uniform(-1.9, 1.9, (count, 3))
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    answers = []
    for threads in (1, 4):
        monkeypatch.setattr(parallel, "_threads", lambda threads=threads: threads)
        parallel._pool.cache_clear()
        hits = rays.first_hit(origins, directions)
        blocked = rays.occluded(origins, origins + directions)
        answers.append((hits.triangle, hits.distance, blocked))
    parallel._pool.cache_clear()
    for one, several in zip(*answers, strict=True):
        np.testing.assert_array_equal(one, several)
    assert (answers[0][0] >= 0).all()
    assert 0 < answers[0][2].sum() < count
