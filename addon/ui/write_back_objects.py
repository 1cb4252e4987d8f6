# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes what objects get of a light into a receiver collection, for Cycles, and takes it back.

The artist's own receiver collection is not touched: the written one takes its place, and knows it.
Relume itself goes on reading the artist's own, and the list.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ..errors import InputError
from ..scene.light_linking import LinkedObjects, cycles_receivers
from ..scene.light_linking_reader import (
    BEFORE_MARK,
    WRITTEN_MARK,
    linked_objects,
    own_receivers,
    read_selection,
)


def write_objects(data: Any) -> None:
    """Have Cycles show what objects get of a light, as far as it can.

    Args:
        data: a `bpy.types.Light`; each of its objects has a list of its own.

    Raises:
        InputError: one of the objects cannot be edited; all are then as they were.
    """
    require_objects_writable(data)
    remove_objects(data)
    for lamp in _lamps(data):
        wanted = _wanted(lamp)
        if wanted is not None:
            _link(lamp, wanted)


def require_objects_writable(data: Any) -> None:
    """Refuse what `write_objects` could not do; nothing is changed.

    Raises:
        InputError: one of the light's objects cannot be edited.
    """
    for lamp in _lamps(data):
        if _wanted(lamp) is not None and (lamp.library is not None or not lamp.is_editable):
            raise InputError(
                f"light '{lamp.name}' is linked from another file; make it local, or write its "
                "objects there"
            )


def remove_objects(data: Any) -> None:
    """Give a light's objects back the receiver collections that they had."""
    for lamp in _lamps(data):
        written = _written(lamp)
        if written is not None:
            lamp.light_linking.receiver_collection = own_receivers(lamp)
            # A copy of the lamp may have it too, and knows its own collection by it alone.
            if written.users == 0:
                bpy.data.collections.remove(written)


def are_objects_written(data: Any) -> bool:
    """Whether any of a light's objects has a receiver collection that Relume wrote."""
    return any(_written(lamp) is not None for lamp in _lamps(data))


def are_objects_current(data: Any) -> bool:
    """Whether Cycles shows what objects get of a light now, as far as it can."""
    return all(linked_objects(_written(lamp)) == _wanted(lamp) for lamp in _lamps(data))


def _wanted(lamp: Any) -> LinkedObjects | None:
    selection = read_selection(lamp)
    if selection is None:
        return None
    return cycles_receivers(linked_objects(own_receivers(lamp)), selection, lamp.name_full)


def _written(lamp: Any) -> Any:
    collection = lamp.light_linking.receiver_collection
    return collection if collection is not None and WRITTEN_MARK in collection else None


def _link(lamp: Any, wanted: LinkedObjects) -> None:
    made = bpy.data.collections.new(f"{lamp.name} in Cycles")
    made[WRITTEN_MARK] = True
    before = lamp.light_linking.receiver_collection
    if before is not None:
        made[BEFORE_MARK] = before
    objects = {obj.name_full: obj for obj in bpy.data.objects}
    for name in sorted((wanted.included | wanted.excluded) & set(objects)):
        made.objects.link(objects[name])
    for obj, link in zip(made.objects, made.collection_objects, strict=True):
        dark = obj.name_full in wanted.excluded
        link.light_linking.link_state = "EXCLUDE" if dark else "INCLUDE"
    lamp.light_linking.receiver_collection = made


def _lamps(data: Any) -> Iterator[Any]:
    return (obj for obj in bpy.data.objects if obj.data == data)
