# SPDX-License-Identifier: GPL-3.0-or-later
"""Which shadow maps are kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pytest

from addon.relight.light_points.light_sample import LightSample
from addon.relight.shadows.shadow_cache import ShadowCache


@dataclass(frozen=True)
class Map:
    """As much of a shadow map as the cache asks for."""

    name: str
    nbytes: int = 10


class Cache:
    """A cache that notes what it draws."""

    def __init__(self, budget: int) -> None:
        self.cache = ShadowCache(budget)
        self.drawn: list[str] = []

    def get(self, light: str, sample: LightSample, name: str) -> str:
        def draw() -> Any:
            self.drawn.append(name)
            return Map(name)

        return cast("Map", self.cache.get(light, sample, draw)).name


def point(x: float, count: int = 4, **more: Any) -> LightSample:
    return LightSample(np.array([x, 0.0, 0.0]), count, **more)


def test_points_that_coincide_share_a_map() -> None:
    cache = Cache(1000)
    assert cache.get("A", point(1.0), "first") == "first"
    assert cache.get("A", point(1.0), "again") == "first"
    assert cache.drawn == ["first"]


DISK = np.array([0.1, 0.0])
OTHERS = {
    "another light": ("B", point(1.0)),
    "another place": ("A", point(2.0)),
    # Of several points, what lies inside the lamp does not cast: see shadow_distance.glsl.
    "a lone point": ("A", point(1.0, count=1)),
    "on a turned disk": ("A", point(1.0, on_disk=DISK)),
    "turned otherwise": ("A", point(1.0, on_disk=DISK, turn=np.array([0.5, 0.0, 0.0]))),
}


def test_what_casts_otherwise_has_a_map_of_its_own() -> None:
    cache = Cache(1000)
    cache.get("A", point(1.0), "first")
    for name, (light, sample) in OTHERS.items():
        assert cache.get(light, sample, name) == name
    assert cache.drawn == ["first", *OTHERS]


def test_the_budget_keeps_what_was_asked_for_last() -> None:
    cache = Cache(30)
    for x, name in ((1.0, "a"), (2.0, "b"), (3.0, "c")):
        cache.get("A", point(x), name)
    cache.get("A", point(1.0), "a again")
    cache.get("A", point(4.0), "d")
    assert cache.cache.nbytes == 30
    assert cache.get("A", point(1.0), "a again") == "a"
    assert cache.get("A", point(2.0), "b again") == "b again"


def test_one_map_is_kept_whatever_its_size() -> None:
    cache = Cache(5)
    cache.get("A", point(1.0), "large")
    assert cache.get("A", point(1.0), "again") == "large"


@pytest.mark.parametrize("light", ["A", "B"])
def test_a_light_that_moves_loses_its_own_maps(light: str) -> None:
    cache = Cache(1000)
    for name in ("A", "B"):
        cache.get(name, point(1.0), name)
    cache.cache.drop(light)
    for name in ("A", "B"):
        cache.get(name, point(1.0), f"{name} again")
    assert cache.drawn == ["A", "B", f"{light} again"]
