# SPDX-License-Identifier: GPL-3.0-or-later
"""Light layers as running sums of samples."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from ..glsl.shader import Texture, framebuffer, texture_2d


@dataclass
class LightLayer:
    """One contribution to the view, as the sum of the samples drawn so far.

    Attributes:
        texture: RGBA32F, scene-linear radiance summed over `samples`.
        target: the framebuffer over it.
        samples: how many samples are in the sum.
    """

    texture: Texture
    target: Any
    samples: int = 0


class LayerStack:
    """All layers of a view, each a mean over the same `count` samples when it is complete."""

    def __init__(self, count: int) -> None:
        self.count = count
        self._layers: dict[str, LightLayer] = {}

    def __getitem__(self, name: str) -> LightLayer:
        return self._layers[name]

    def get(self, name: str) -> LightLayer | None:
        """The layer of that name, if there is one."""
        return self._layers.get(name)

    def require(self, names: Iterable[str], width: int, height: int) -> None:
        """Make the named layers exist, empty if new, and drop all others."""
        wanted = list(names)
        self._layers = {name: self._layers[name] for name in wanted if name in self._layers}
        for name in wanted:
            if name not in self._layers:
                texture = texture_2d(width, height)
                target = framebuffer([texture])
                with target.bind():
                    target.clear(color=(0.0, 0.0, 0.0, 0.0))
                self._layers[name] = LightLayer(texture, target)

    def drop(self, name: str) -> None:
        """Forget a layer whose light changed."""
        self._layers.pop(name, None)

    def clear(self) -> None:
        """Forget all layers."""
        self._layers.clear()

    @property
    def next_sample(self) -> int | None:
        """The lowest sample that some layer still lacks; None when all are complete."""
        lowest = min((layer.samples for layer in self._layers.values()), default=self.count)
        return lowest if lowest < self.count else None

    def advance(self, draw: Callable[[str, LightLayer, int], None]) -> None:
        """Draw the next sample into the layers that lack it.

        Args:
            draw: adds sample k of a layer: called as draw(name, layer, k).
        """
        k = self.next_sample
        if k is None:
            return
        for name, layer in self._layers.items():
            if layer.samples == k:
                draw(name, layer, k)
                layer.samples += 1
