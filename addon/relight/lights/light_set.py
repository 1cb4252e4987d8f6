# SPDX-License-Identifier: GPL-3.0-or-later
"""The lights of a session, their layers, and which layers are in the picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...scene.light import Light
from ..graph.frame_passes import EMISSION_LAYER, WORLD_LAYER, layer_pass, light_input
from .light_edit import changed_parts, layer_scale


@dataclass(frozen=True)
class LightChanges:
    """How a set of lights differs from the one before.

    Attributes:
        inputs: of the frame graph, that changed.
        gone: names of lights that are no more.
        edited: the layers of lights that are new or changed in any way, in the lights' order.
    """

    inputs: tuple[str, ...]
    gone: tuple[str, ...]
    edited: tuple[str, ...]


class LightSet:
    """Lights by name, in their order, with a layer for each beside the world's and the glow's.

    Args:
        has_emission: whether there is a layer of what glows.
    """

    def __init__(self, *, has_emission: bool) -> None:
        self._has_emission = has_emission
        self._lights: dict[str, Light] = {}
        self._light_of_layer: dict[str, Light] = {}
        self._muted: frozenset[str] = frozenset()

    def __iter__(self) -> Iterator[Light]:
        return iter(self._lights.values())

    def replace(self, lights: Sequence[Light]) -> LightChanges:
        """Have these lights instead. Those that are as before stay the same objects, as what was
        made for them is known by them."""
        new = {light.name: light for light in lights}
        inputs: list[str] = []
        edited = set(new) - set(self._lights)
        for name, light in self._lights.items():
            if name in new:
                parts = changed_parts(light, new[name])
                inputs += [light_input(name, part) for part in parts]
                if parts:
                    edited.add(name)
                elif (light.mute, light.solo) == (new[name].mute, new[name].solo):
                    new[name] = light
        gone = tuple(name for name in self._lights if name not in new)
        self._lights = new
        self._light_of_layer = {layer_pass(name): light for name, light in new.items()}
        in_order = tuple(layer_pass(name) for name in new if name in edited)
        return LightChanges(tuple(inputs), gone, in_order)

    def mute(self, *, world: bool, emission: bool) -> None:
        """Leave the world's light out, or what glows and its light; lights say it of themselves."""
        muted = ((WORLD_LAYER, world), (EMISSION_LAYER, emission))
        self._muted = frozenset(name for name, mute in muted if mute)

    def of_layer(self, layer: str) -> Light | None:
        """The light whose layer that is; None for the world's and the glow's."""
        return self._light_of_layer.get(layer)

    @property
    def layers(self) -> list[str]:
        """The names of all layers."""
        # The world's layer is always there: it holds the picture's alpha.
        names = [*self._light_of_layer, WORLD_LAYER]
        return [*names, EMISSION_LAYER] if self._has_emission else names

    @property
    def audible(self) -> list[str]:
        """The layers that are in the picture: soloed lights alone, else what is not muted."""
        lights = self._light_of_layer
        if any(light.solo for light in lights.values()):
            return [layer for layer, light in lights.items() if light.solo]
        silent = self._muted | self._silent_lights()
        return [name for name in self.layers if name not in silent]

    @property
    def wanted(self) -> list[str]:
        """The layers to draw: those in the picture, and the world's, which holds its alpha."""
        return list(dict.fromkeys([*self.audible, WORLD_LAYER]))

    def scale(self, layer: str) -> NDArray[np.float64]:
        """(3,) what a layer is multiplied with in the sum."""
        light = self.of_layer(layer)
        return np.ones(3) if light is None else layer_scale(light)

    def shown_name(self, layer: str) -> str:
        """A layer's name for people: the light's, and where that is "World", say, the world's is
        another."""
        light = self.of_layer(layer)
        if light is not None:
            return light.name
        return f"{layer} (scene)" if layer in self._lights else layer

    def _silent_lights(self) -> set[str]:
        mutes_glow = EMISSION_LAYER in self._muted
        return {
            layer
            for layer, light in self._light_of_layer.items()
            if light.mute or (mutes_glow and light.type == "MESH")
        }
