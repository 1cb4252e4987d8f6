# SPDX-License-Identifier: GPL-3.0-or-later
"""Which cameras of an earlier placement are kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .budget import Budget
from .coverage import joined
from .offer import Group
from .settings import PlacementSettings

# An earlier camera is kept if the score without it would be lower by this share of the least
# gain. Cameras that came later may see what it sees too, so it is asked less than a new one.
STILL_EARNS = 0.25


def kept_groups(
    groups: Sequence[Group], weight: NDArray[np.float64], settings: PlacementSettings
) -> list[Group]:
    """Those that still earn their place, within the budget, in their order.

    The one that is missed least, for its number of pictures where they are too many, goes
    first, until all that are left are missed enough and paid for. `weight` is (S,).
    """
    kept = [group for group in groups if group and not _too_dear(group, settings)]
    while kept:
        over = _too_many(kept, settings)
        number, loss = least_missed(kept, weight, over, for_cost=bool(over))
        if not over and loss >= STILL_EARNS * settings.least_gain:
            break
        del kept[number]
    return kept


def least_missed(
    groups: Sequence[Group],
    weight: NDArray[np.float64],
    among: Sequence[int] = (),
    *,
    for_cost: bool = False,
) -> tuple[int, float]:
    """The group, `among` those named or all, without which the score falls least, and by what.

    With `for_cost` the fall is divided by the number of pictures that are saved.
    """
    numbers = list(among) or list(range(len(groups)))
    whole = _worth(groups, weight)
    losses = [
        whole - _worth([g for index, g in enumerate(groups) if index != number], weight)
        for number in numbers
    ]
    saved = [len(groups[number]) if for_cost else 1 for number in numbers]
    least = int(np.argmin(np.array(losses) / saved))
    return numbers[least], losses[least]


def _worth(groups: Sequence[Group], weight: NDArray[np.float64]) -> float:
    worth = np.zeros(len(weight))
    for group in groups:
        for choice in group:
            worth = joined(worth, choice.seen)
    return float(weight @ worth)


def _too_dear(group: Group, settings: PlacementSettings) -> bool:
    """Whether the budget could not even pay for this one alone."""
    texels = sum(choice.texels for choice in group)
    return settings.budgeted and not Budget.of(settings).fits(len(group), texels)


def _too_many(groups: Sequence[Group], settings: PlacementSettings) -> list[int]:
    """Numbers of the groups one of which must go; none if all can be paid for."""
    if settings.budgeted:
        choices = [choice for group in groups for choice in group]
        texels = sum(choice.texels for choice in choices)
        paid = Budget.of(settings).fits(len(choices), texels)
        return [] if paid else list(range(len(groups)))
    cubes = [n for n, group in enumerate(groups) if group[0].camera.kind == "CUBE_FACE"]
    others = [n for n in range(len(groups)) if n not in cubes]
    if len(cubes) > settings.primaries:
        return cubes
    return others if len(others) > settings.secondaries else []
