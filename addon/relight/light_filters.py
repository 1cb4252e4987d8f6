# SPDX-License-Identifier: GPL-3.0-or-later
"""The filters that a light's controls ask for, in the order in which they are applied."""

from __future__ import annotations

from collections.abc import Callable

from ..scene.light import Light
from .light_filter import LightFilter

# Each makes one filter of a light, or None where the light does not need it.
_MAKERS: tuple[Callable[[Light], LightFilter | None], ...] = ()


class LightFilters:
    """Makes lights' filters, and keeps those of lights that did not change.

    Textures are uploaded once for each light.
    """

    def __init__(self) -> None:
        self._made: dict[str, tuple[Light, tuple[LightFilter, ...]]] = {}

    def of(self, light: Light) -> tuple[LightFilter, ...]:
        """The filters of a light. Needs a GPU context."""
        known = self._made.get(light.name)
        if known is None or known[0] is not light:
            filters = tuple(f for make in _MAKERS if (f := make(light)) is not None)
            self._made[light.name] = known = (light, filters)
        return known[1]

    def forget(self, name: str) -> None:
        """A light is gone."""
        self._made.pop(name, None)
