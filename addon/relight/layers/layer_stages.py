# SPDX-License-Identifier: GPL-3.0-or-later
"""The stages in which a view's layers come: coarse, one sample, a few, the growing mean."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from .layer_stack import LayerStack, LightLayer

# A running mean replaces the centred preview once it has this many samples: fewer would jump
# between single hard shadows.
_STEADY_SAMPLES = 4

# Where a layer's preview took longer than this, seconds, a coarse one is shown before it.
_COARSE_ABOVE_S = 0.04

# View pixels along the side of a coarse layer's pixel: a sixteenth of the work.
COARSE_STRIDE = 4


@dataclass(frozen=True)
class StagedLayer:
    """A layer as one of the stages has it."""

    stack: LayerStack
    layer: LightLayer


class LayerStages:
    """Stacks of a view's layers, of which each layer shows the best that it has.

    The samples of a light that is parted into cells make its highlight only together: a mirror
    would show the cells drawn so far. Its layer has a mean of few samples, of a light parted into
    as many, between the preview and the finished mean.

    Attributes:
        preview_s: seconds that a full layer's preview took the last time.

    Args:
        samples: of a finished layer.
        parts: how many textures the layer of a name has.
        in_cells: whether the layer of a name is that of a light parted into cells.
    """

    def __init__(
        self, samples: int, parts: Callable[[str], int], in_cells: Callable[[str], bool]
    ) -> None:
        self._parts = parts
        self._in_cells = in_cells
        self.preview_s = 0.0
        self._moved = False
        self._coarse = LayerStack(1, COARSE_STRIDE, parts)
        self._preview = LayerStack(1, parts=parts)
        self._draft = LayerStack(_STEADY_SAMPLES, parts=parts)
        self._refined = LayerStack(samples, parts=parts)

    @property
    def count(self) -> int:
        """Samples of a finished layer."""
        return self._refined.count

    def set_count(self, samples: int) -> None:
        """Refine to another number of samples, from the first one on."""
        self._refined = LayerStack(samples, parts=self._parts)

    def require(self, names: Sequence[str], width: int, height: int) -> None:
        """Make the layers of a view exist: rough ones only where nothing better is."""
        self._refined.require(names, width, height)
        unsteady = [name for name in names if not self._is_steady(name)]
        few = self.count > _STEADY_SAMPLES
        self._draft.require([n for n in unsteady if few and self._in_cells(n)], width, height)
        rough = [name for name in unsteady if not self._has_draft(name)]
        self._preview.require(rough, width, height)
        coarse = [n for n in rough if self._preview.samples(n) == 0]
        slow = self.preview_s > _COARSE_ABOVE_S and not self._moved
        self._coarse.require(coarse if slow else [], width, height)

    def drop(self, names: Collection[str]) -> None:
        """Forget layers at every stage."""
        self._moved = False
        for stack in self._stacks:
            for name in names:
                stack.drop(name)

    def note_move(self) -> None:
        """All was dropped because the camera moved: then coarse layers would only put off the full
        ones. Who shows a moving view asks for a smaller one (`ui/progressive_picture.py`)."""
        self._moved = True

    def advance(
        self,
        names: Collection[str],
        drawer: Callable[[LayerStack], Callable[[str, LightLayer, int], None]],
        first: Collection[str],
    ) -> tuple[str, StagedLayer] | None:
        """Add one sample to one of the named layers, at the earliest stage that lacks any.

        Args:
            names: the layers that are wanted.
            drawer: gives what draws the samples of a stack, see `LayerStack.advance`.
            first: layers to take before others.

        Returns:
            the layer's name and the layer; None when all are finished.
        """
        for stack in self._stacks:
            name = stack.advance(names, drawer(stack), first)
            if name is not None:
                return name, StagedLayer(stack, stack[name])
        return None

    def refine(
        self,
        names: Collection[str],
        drawer: Callable[[LayerStack], Callable[[str, LightLayer, int], None]],
    ) -> str | None:
        """Add one sample to a named layer's mean; its name, None when all are finished."""
        return self._refined.advance(names, drawer(self._refined))

    def has_previews(self, names: Collection[str]) -> bool:
        """Whether there is something at full resolution to show of each of the named layers."""
        shown = [self.shown(name) for name in names]
        return all(each is not None and each.stack.stride == 1 for each in shown)

    def next_sample(self, names: Collection[str]) -> int | None:
        """The lowest sample that the mean of some named layer lacks."""
        return self._refined.next_sample(names)

    def samples(self, name: str) -> int:
        """Samples in a layer's mean."""
        return self._refined.samples(name)

    def finished(self, name: str) -> bool:
        """Whether a layer's mean has all its samples."""
        return self.samples(name) == self.count

    def mean(self, name: str) -> LightLayer:
        """A layer's mean, as it stands."""
        return self._refined[name]

    def is_first_of_move(self, stack: LayerStack) -> bool:
        """Whether that stack's samples are the first picture after a camera move."""
        return self._moved and stack is self._preview

    def is_preview(self, staged: StagedLayer) -> bool:
        """Whether that is a layer's one sample at full resolution."""
        return staged.stack is self._preview

    def shown(self, name: str) -> StagedLayer | None:
        """The best that there is of a layer; None for nothing."""
        if self._is_steady(name):
            return StagedLayer(self._refined, self._refined[name])
        if self._has_draft(name):
            return StagedLayer(self._draft, self._draft[name])
        for stack in (self._preview, self._refined, self._coarse):
            layer = stack.get(name)
            if layer is not None and layer.samples:
                return StagedLayer(stack, layer)
        return None

    @property
    def _stacks(self) -> tuple[LayerStack, ...]:
        """In the order in which they are drawn."""
        return self._coarse, self._preview, self._draft, self._refined

    def _is_steady(self, name: str) -> bool:
        """Whether a layer's mean is to be shown instead of anything before it."""
        layer = self._refined.get(name)
        few = self.count if self._in_cells(name) else min(_STEADY_SAMPLES, self.count)
        return layer is not None and layer.samples >= few

    def _has_draft(self, name: str) -> bool:
        layer = self._draft.get(name)
        return layer is not None and layer.samples == self._draft.count
