# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds what EDITS.json calls by dotted names: Relume's own controls of a light.

    {"Key": {"barn_doors.use": true, "barn_doors.width": 0.3, "blockers.Flag.density": 0.5}}

The names are those of `light.relume` (addon/ui/light_properties.py); a blocker goes by the name of
its object.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ...errors import InputError

_GROUP = "relume"


def find_control(light: Any, name: str) -> tuple[str, Any] | None:
    """A light object's control: its path from the light's data, and what Blender declares of it.

    Returns:
        None if the light has no such control.
    """
    controls = getattr(light.data, _GROUP, None)
    if controls is None:
        return None
    path, owner = _GROUP, controls
    first, _, rest = name.partition(".")
    if first == "blockers" and rest:
        card, _, name = rest.rpartition(".")
        number = _blocker(controls, card)
        if number is None:
            return None
        path, owner = f"{_GROUP}.blockers[{number}]", controls.blockers[number]
    elif rest:
        if _type(controls, first) != "POINTER":
            return None
        path, owner, name = f"{_GROUP}.{first}", getattr(controls, first), rest
    declared = owner.bl_rna.properties.get(name)
    if declared is None or not _is_control(declared):
        return None
    return f"{path}.{name}", declared


def control_names(light: Any) -> Iterator[str]:
    """The names of all controls that a light object has."""
    controls = getattr(light.data, _GROUP, None)
    if controls is None:
        return
    for declared in _controls(controls):
        yield declared.identifier
    for group in controls.bl_rna.properties:
        if group.type == "POINTER" and _is_group(group):
            for declared in _controls(getattr(controls, group.identifier)):
                yield f"{group.identifier}.{declared.identifier}"
    for blocker in controls.blockers:
        if blocker.object is not None:
            for declared in _controls(blocker):
                yield f"blockers.{blocker.object.name}.{declared.identifier}"


def find_block(what: str, declared: Any, value: Any, blocks: Any) -> Any:
    """A data-block by its name; null for none.

    Args:
        what: the control, for the message.
        declared: its property.
        value: the name.
        blocks: what there is: has get(name).

    Raises:
        InputError: there is none of that name.
    """
    if value is None:
        return None
    found = blocks.get(value) if isinstance(value, str) else None
    if found is None:
        kind = declared.fixed_type.name.lower()
        raise InputError(
            f"{what} must be the name of an {kind} in the file, or null: not {value!r}"
        )
    return found


def _blocker(controls: Any, name: str) -> int | None:
    for number, blocker in enumerate(controls.blockers):
        if blocker.object is not None and blocker.object.name == name:
            return number
    return None


def _type(group: Any, name: str) -> str | None:
    declared = group.bl_rna.properties.get(name)
    return None if declared is None else str(declared.type)


def _is_group(declared: Any) -> bool:
    return bool(declared.fixed_type.identifier.startswith("RELUME_PG_"))


def _is_control(declared: Any) -> bool:
    """Whether an edit may set a property: its value, or the data-block that it points to."""
    if declared.identifier == "name" or declared.is_readonly:
        return False
    if declared.type == "POINTER":
        return not _is_group(declared)
    return declared.type in ("BOOLEAN", "ENUM", "FLOAT")


def _controls(group: Any) -> Iterator[Any]:
    return (declared for declared in group.bl_rna.properties if _is_control(declared))
