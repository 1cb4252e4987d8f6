# SPDX-License-Identifier: GPL-3.0-or-later
"""The filters that a light's controls ask for, in the order in which they are applied."""

from __future__ import annotations

from collections.abc import Callable

from ...scene.light import Light
from ...scene.same import is_same
from .barn_doors import barn_doors_filter
from .blockers import blockers_filter
from .distance import distance_filter, falloff_filter
from .light_filter import LightFilter
from .noise import noise_filter
from .profile import ProfileFilters
from .slide import SlideFilters

# Each makes one filter of a light, or None where the light does not need it.
_MAKERS: tuple[Callable[[Light], LightFilter | None], ...] = (
    distance_filter,
    barn_doors_filter,
    blockers_filter,
    noise_filter,
    falloff_filter,
)


class LightFilters:
    """Makes lights' filters, and keeps those of lights that did not change.

    Textures are uploaded once for each light.
    """

    def __init__(self) -> None:
        self._slides = SlideFilters()
        self._profiles = ProfileFilters()
        self._made: dict[str, tuple[Light, tuple[LightFilter, ...]]] = {}

    def of(self, light: Light) -> tuple[LightFilter, ...]:
        """The filters of a light. Needs a GPU context."""
        known = self._made.get(light.name)
        if known is None or not _filtered_alike(known[0], light):
            made = (make(light) for make in (*_MAKERS, self._slides.of, self._profiles.of))
            filters = tuple(each for each in made if each is not None)
            self._made[light.name] = known = (light, filters)
        return known[1]

    def forget(self, name: str) -> None:
        """A light is gone."""
        self._made.pop(name, None)
        self._slides.forget(name)
        self._profiles.forget(name)


def _filtered_alike(a: Light, b: Light) -> bool:
    """Whether two states of a light have the same filters: blockers depend on where it is."""
    return a is b or (
        a.type == b.type
        and is_same(a.controls, b.controls)
        and is_same(a.profile, b.profile)
        and is_same(a.world_from_light, b.world_from_light)
    )
