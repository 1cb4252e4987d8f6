# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects a light lights, which cast its shadows, and how much of it each gets.

Objects go by their full names in Blender, libraries in them. Receivers and blockers follow
Blender's light linking (source/blender/depsgraph/intern/light_linking.cc,
intern/cycles/blender/light_linking.cpp); weights are the "object selection" of the uberlight
(F. Pellacini and K. Vidimce, Cinematic Lighting, GPU Gems 10).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .geometry import SceneGeometry


@dataclass(frozen=True)
class LinkedObjects:
    """What a light's receiver or blocker collection says.

    Attributes:
        included: where there are any, all others are left out.
        excluded: these are left out.
        named: all that the scene's collections of this kind include or exclude, whosever they
            are. An instance goes by the name of its instancer if that is among them, else by
            its own object's.
    """

    included: frozenset[str] = frozenset()
    excluded: frozenset[str] = frozenset()
    named: frozenset[str] = frozenset()

    def holds(self, instancer: str, name: str) -> bool:
        """Whether an object is linked; `instancer` is "" where nothing instances it."""
        own = instancer if instancer in self.named else name
        return own not in self.excluded and (not self.included or own in self.included)


@dataclass(frozen=True)
class ObjectWeight:
    """How much of a light one object gets, through each kind of lobe; 1 is what it would."""

    name: str
    diffuse: float = 1.0
    specular: float = 1.0


@dataclass(frozen=True)
class ObjectSelection:
    """How much of a light objects get.

    Attributes:
        weights: at most one for a name. An instance goes by its instancer's name if that has
            one, else by its own object's.
        others: the weight of all that have none.
    """

    weights: tuple[ObjectWeight, ...] = ()
    others: float = 1.0

    @cached_property
    def by_name(self) -> dict[str, tuple[float, float]]:
        """(diffuse, specular)."""
        return {each.name: (each.diffuse, each.specular) for each in self.weights}

    def of(self, instancer: str, name: str) -> tuple[float, float]:
        """(diffuse, specular) of an object; `instancer` is "" where nothing instances it."""
        for own in (instancer, name):
            if own in self.by_name:
                return self.by_name[own]
        return self.others, self.others


@dataclass(frozen=True)
class LightLinking:
    """What of the scene has to do with a light. None stands for all alike.

    Attributes:
        receivers: what it lights.
        blockers: what casts its shadows, of what casts any.
        selection: the artist's weights, beside `receivers`.
    """

    receivers: LinkedObjects | None = None
    blockers: LinkedObjects | None = None
    selection: ObjectSelection | None = None


UNLINKED = LightLinking()


def receiver_weights(linking: LightLinking, geometry: SceneGeometry) -> NDArray[np.float64]:
    """(N, 2) how much of a light each of the N objects gets: diffuse, specular."""
    receivers, selection = linking.receivers, linking.selection

    def weight(instancer: str, name: str) -> tuple[float, float]:
        if receivers is not None and not receivers.holds(instancer, name):
            return 0.0, 0.0
        return (1.0, 1.0) if selection is None else selection.of(instancer, name)

    return np.array(_of_each(geometry, weight), dtype=np.float64).reshape(-1, 2)


def blockers(linking: LightLinking, geometry: SceneGeometry) -> NDArray[np.bool_]:
    """(N,) which of the N objects a light's linking lets cast its shadows."""
    linked = linking.blockers
    if linked is None:
        return np.ones(len(geometry.object_names), dtype=np.bool_)
    return np.array(_of_each(geometry, linked.holds), dtype=np.bool_)


def _of_each[T](geometry: SceneGeometry, value: Callable[[str, str], T]) -> list[T]:
    """A value for each object; those of one name are asked for once."""
    names = geometry.full_names or tuple(("", name) for name in geometry.object_names)
    known = {both: value(*both) for both in set(names)}
    return [known[both] for both in names]


def cycles_receivers(
    receivers: LinkedObjects | None, selection: ObjectSelection, lamp: str
) -> LinkedObjects | None:
    """The receiver collection that shows a selection in Cycles as nearly as one can.

    Weights are 0 or 1 there, the same for all lobes: what gets any of the light gets it whole.
    `beyond_cycles` names what that changes.

    Args:
        receivers: what the artist's own receiver collection says.
        selection: the weights that count beside it.
        lamp: the light object's full name. It stands in for an object where none is to be lit:
            a collection that includes nothing would light everything.

    Returns:
        None where all objects that the artist's own collection links are lit.
    """
    lit = frozenset(w.name for w in selection.weights if max(w.diffuse, w.specular) > 0.0)
    dark = frozenset(w.name for w in selection.weights) - lit
    if selection.others > 0.0 and not dark:
        return None
    own = receivers or LinkedObjects()
    excluded = own.excluded | dark
    if selection.others == 0.0:
        included = own.included & lit if own.included else lit
    elif own.included:
        included = own.included
    else:
        return LinkedObjects(excluded=excluded)
    return LinkedObjects(included - excluded or frozenset([lamp]), excluded)


def beyond_cycles(selection: ObjectSelection) -> tuple[str, ...]:
    """What `cycles_receivers` cannot show, one sentence each; none where Cycles shows it all."""
    sentences = [
        f"object '{each.name}' gets {each.diffuse:g} of its diffuse and {each.specular:g} of its "
        "specular light; Cycles' light linking gives all or nothing"
        for each in selection.weights
        if (each.diffuse, each.specular) not in ((0.0, 0.0), (1.0, 1.0))
    ]
    if selection.others not in (0.0, 1.0):
        sentences.append(
            f"other objects get {selection.others:g} of its light; Cycles' light linking gives "
            "all or nothing"
        )
    return tuple(sentences)
