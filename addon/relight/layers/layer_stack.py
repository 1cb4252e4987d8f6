# SPDX-License-Identifier: GPL-3.0-or-later
"""Light layers as running sums of samples."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field
from typing import Any

from ...glsl.shader import Texture, framebuffer, texture_2d

_SERIAL = itertools.count()


@dataclass
class LightLayer:
    """One contribution to the view, as the sum of the samples drawn so far.

    Attributes:
        textures: RGBA32F, scene-linear radiance summed over `samples`; one, or one for each part
            of it that lobes are split into.
        target: the framebuffer over them.
        samples: how many samples are in the sum.
        serial: tells this layer from those that had its name before.
    """

    textures: tuple[Texture, ...]
    target: Any
    samples: int = 0
    serial: int = field(default_factory=lambda: next(_SERIAL))


class LayerStack:
    """All layers of a view, each a mean over the same `count` samples when it is complete.

    Args:
        count: samples of a complete layer.
        stride: view pixels along the side of one of the layers' pixels.
        parts: how many textures the layer of a name has.
    """

    def __init__(
        self, count: int, stride: int = 1, parts: Callable[[str], int] = lambda _: 1
    ) -> None:
        self.count = count
        self.stride = stride
        self._parts = parts
        self._layers: dict[str, LightLayer] = {}
        self._wanted: tuple[str, ...] = ()
        self._size = (0, 0)

    def __getitem__(self, name: str) -> LightLayer:
        return self._layers[name]

    def get(self, name: str) -> LightLayer | None:
        """The layer of that name, if it has any sample."""
        return self._layers.get(name)

    def samples(self, name: str) -> int:
        """Samples in the layer of that name."""
        layer = self._layers.get(name)
        return 0 if layer is None else layer.samples

    def require(self, names: Iterable[str], width: int, height: int) -> None:
        """Want the named layers of a view, empty if new, and drop all others.

        They are made when they get their first sample: of those that a moving view never comes to,
        not even the memory is touched.
        """
        self._wanted = tuple(names)
        self._layers = {name: self._layers[name] for name in self._wanted if name in self._layers}
        self._size = (-(-width // self.stride), -(-height // self.stride))

    def drop(self, name: str) -> None:
        """Forget a layer whose light changed."""
        self._layers.pop(name, None)

    def clear(self) -> None:
        """Forget all layers."""
        self._layers.clear()

    def next_sample(self, names: Iterable[str]) -> int | None:
        """The lowest sample that some of the named layers lacks; None when all are complete."""
        done = [self.samples(name) for name in names if name in self._wanted]
        lowest = min(done, default=self.count)
        return lowest if lowest < self.count else None

    def advance(
        self,
        names: Collection[str],
        draw: Callable[[str, LightLayer, int], None],
        first: Collection[str] = (),
    ) -> str | None:
        """Draw the next sample into one of those named layers that have the fewest.

        Args:
            names: which layers; those that are not wanted are passed over.
            draw: adds sample k of a layer: called as draw(name, layer, k).
            first: layers to take before others.

        Returns:
            the layer's name; None when all are complete.
        """
        k = self.next_sample(names)
        if k is None:
            return None
        behind = [n for n in names if n in self._wanted and self.samples(n) == k]
        name = next((name for name in behind if name in first), behind[0])
        layer = self._layers.get(name)
        if layer is None:
            layer = self._layers[name] = self._empty(name)
        draw(name, layer, k)
        layer.samples += 1
        return name

    def _empty(self, name: str) -> LightLayer:
        textures = tuple(texture_2d(*self._size) for _ in range(self._parts(name)))
        target = framebuffer(textures)
        with target.bind():
            target.clear(color=(0.0, 0.0, 0.0, 0.0))
        return LightLayer(textures, target)
