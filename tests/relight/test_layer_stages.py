# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a layer is shown while it is refined."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from addon.relight.layers.layer_stack import LayerStack, LightLayer

pytestmark = pytest.mark.usefixtures("gpu_context")

NAMES = ["Point", "Area"]


def shown_samples(
    count: int, *, slow: bool = False, moved: bool = False
) -> dict[str, list[tuple[int, int, int]]]:
    """For each layer, (stride, samples shown, of how many) after every sample that is drawn."""
    from addon.relight.layers.layer_stages import LayerStages

    stages = LayerStages(count, lambda _: 1, lambda name: name == "Area")
    stages.preview_s = 1.0 if slow else 0.0
    if moved:
        stages.drop(NAMES)
        stages.note_move()

    def drawer(stack: LayerStack) -> Callable[[str, LightLayer, int], None]:
        return lambda name, layer, k: None

    history: dict[str, list[tuple[int, int, int]]] = {name: [] for name in NAMES}
    stages.require(NAMES, 8, 8)
    while stages.advance(NAMES, drawer, ()) is not None:
        for name in NAMES:
            staged = stages.shown(name)
            if staged is not None:
                seen = (staged.stack.stride, staged.layer.samples, staged.stack.count)
                if not history[name] or history[name][-1] != seen:
                    history[name].append(seen)
        stages.require(NAMES, 8, 8)
    return history


def test_a_mean_replaces_the_preview_when_it_is_steady() -> None:
    assert shown_samples(8)["Point"] == [(1, 1, 1), *((1, k, 8) for k in range(4, 9))]


def test_a_light_in_cells_is_only_shown_whole() -> None:
    """Its preview, then four samples of a light in four cells, then all of the finished mean."""
    assert shown_samples(8)["Area"] == [(1, 1, 1), (1, 4, 4), (1, 8, 8)]


@pytest.mark.parametrize("count", [1, 2, 4])
def test_few_samples_need_no_stage_between(count: int) -> None:
    assert shown_samples(count)["Area"] == [(1, 1, 1), *([(1, count, count)] if count > 1 else [])]


def test_a_slow_view_begins_coarsely() -> None:
    for history in shown_samples(8, slow=True).values():
        assert history[:2] == [(4, 1, 1), (1, 1, 1)]


def test_a_moved_view_comes_in_full_at_once() -> None:
    """However slow; and an edit after it begins coarsely again."""
    from addon.relight.layers.layer_stages import LayerStages

    for history in shown_samples(8, slow=True, moved=True).values():
        assert history[0] == (1, 1, 1)
    stages = LayerStages(8, lambda _: 1, lambda _: False)
    stages.preview_s = 1.0
    stages.note_move()
    stages.drop(["Point"])
    stages.require(NAMES, 8, 8)
    first = stages.advance(NAMES, lambda _: lambda name, layer, k: None, ())
    assert first is not None
    assert first[1].stack.stride == 4
