# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the light linking of a dependency graph's lights, and Relume's own object weights."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from math import prod
from typing import Any, Literal

import bpy

from .light_linking import (
    UNLINKED,
    LightLinking,
    LinkedObjects,
    ObjectSelection,
    ObjectWeight,
)

# The property group's name on a `bpy.types.Object`.
SELECTION_NAME = "relume_objects"

# Custom properties of a receiver collection that Relume wrote for Cycles: that it did, and the
# collection that was there before.
WRITTEN_MARK = "relume_written"
BEFORE_MARK = "relume_before"

_Kind = Literal["receiver_collection", "blocker_collection"]


class LinkingReader:
    """Reads what links the lights of one dependency graph to its objects."""

    def __init__(self, depsgraph: Any) -> None:
        self._depsgraph = depsgraph

    def of(self, evaluated: Any) -> LightLinking:
        """The linking of a light's evaluated object."""
        original = evaluated.original
        linking = LightLinking(
            self._linked(original, "receiver_collection"),
            self._linked(original, "blocker_collection"),
            read_selection(evaluated),
        )
        return UNLINKED if linking == UNLINKED else linking

    def _linked(self, original: Any, kind: _Kind) -> LinkedObjects | None:
        linked = linked_objects(_collection(original, kind))
        if linked is None:
            return None
        named = self._receivers if kind == "receiver_collection" else self._blockers
        return replace(linked, named=named)

    @cached_property
    def _receivers(self) -> frozenset[str]:
        return self._named("receiver_collection")

    @cached_property
    def _blockers(self) -> frozenset[str]:
        return self._named("blocker_collection")

    def _named(self, kind: _Kind) -> frozenset[str]:
        """All objects that any emitter in the graph is linked to, hidden emitters too."""
        collections = {
            collection
            for block in self._depsgraph.ids
            if isinstance(block, bpy.types.Object)
            and (collection := _collection(block.original, kind)) is not None
        }
        return frozenset(name for each in collections for name in _link_states(each))


def read_emitter_linking(depsgraph: Any) -> dict[str, LightLinking]:
    """The linking of objects other than lights, by name: it counts where their surfaces glow."""
    reader = LinkingReader(depsgraph)
    found = {
        block.original.name: reader.of(block)
        for block in depsgraph.ids
        if isinstance(block, bpy.types.Object) and block.type != "LIGHT"
    }
    return {name: linking for name, linking in found.items() if linking is not UNLINKED}


def _collection(original: Any, kind: _Kind) -> Any:
    """The artist's own collection."""
    if kind == "receiver_collection":
        return own_receivers(original)
    linking = getattr(original, "light_linking", None)
    return linking.blocker_collection if linking is not None else None


def own_receivers(original: Any) -> Any:
    """An object's receiver collection, or the one that was in place of what Relume wrote."""
    linking = getattr(original, "light_linking", None)
    collection = linking.receiver_collection if linking is not None else None
    if collection is not None and WRITTEN_MARK in collection:
        return collection.get(BEFORE_MARK)
    return collection


def linked_objects(collection: Any) -> LinkedObjects | None:
    """What a receiver or blocker collection says; None where there is none, or it is empty.

    Cycles, too, takes a collection without an object for none.
    """
    states = {} if collection is None else _link_states(collection)
    if not states:
        return None
    return LinkedObjects(
        frozenset(name for name, state in states.items() if state == "INCLUDE"),
        frozenset(name for name, state in states.items() if state == "EXCLUDE"),
    )


def _link_states(collection: Any) -> dict[str, str]:
    """INCLUDE or EXCLUDE by object's full name.

    A collection's state is that of all within it, however deep. What comes later wins, and
    objects in the collection itself come last.
    """
    states: dict[str, str] = {}
    for child, link in zip(collection.children, collection.collection_children, strict=True):
        for obj in child.all_objects:
            states[obj.name_full] = link.light_linking.link_state
    for obj, link in zip(collection.objects, collection.collection_objects, strict=True):
        states[obj.name_full] = link.light_linking.link_state
    return states


def read_selection(obj: Any) -> ObjectSelection | None:
    """The object weights that a light object has; None where all objects are alike.

    The weights of an object that is listed more than once, or in collections, multiply.

    Args:
        obj: a `bpy.types.Object`; an evaluated one for animated weights.
    """
    settings = _settings(obj)
    if settings is None:
        return None
    found: dict[str, list[tuple[float, float]]] = {}
    for entry in _value(settings, "entries", ()):
        weight = float(_value(entry, "weight", 1.0))
        diffuse = weight if _value(entry, "use_diffuse", True) else 1.0
        specular = weight if _value(entry, "use_specular", True) else 1.0
        for name in _names(entry):
            found.setdefault(name, []).append((diffuse, specular))
    weights = tuple(
        ObjectWeight(name, prod(w[0] for w in each), prod(w[1] for w in each))
        for name, each in sorted(found.items())
    )
    selection = ObjectSelection(weights, float(_value(settings, "others", 1.0)))
    return None if selection == ObjectSelection() else selection


def _settings(obj: Any) -> Any:
    """The list's group; also where the extension is not registered, as on the command line."""
    if hasattr(obj, SELECTION_NAME):
        return getattr(obj, SELECTION_NAME)
    kept = obj.bl_system_properties_get()
    return None if kept is None else kept.get(SELECTION_NAME)


def _value(group: Any, name: str, default: Any) -> Any:
    """A property's value; of a bare group its default where it was never set."""
    if isinstance(group, bpy.types.PropertyGroup):
        return getattr(group, name)
    return group.get(name, default)


def _names(entry: Any) -> set[str]:
    """The full names of the objects that an entry is about."""
    collection, own = (_value(entry, name, None) for name in ("collection", "object"))
    objects = set() if collection is None else {obj.name_full for obj in collection.all_objects}
    return objects if own is None else objects | {own.name_full}
