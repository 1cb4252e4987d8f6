# SPDX-License-Identifier: GPL-3.0-or-later
"""SURFACES.json: what to change about a scene's surfaces while it is relit.

    {"materials": {"Wood": {"gain": 0.5, "tint": [1, 0.9, 0.8]}},
     "objects": {"Chair": {"roughness": 1.2, "specular": 0.5}, "Table": null}}

The attributes are those of `SurfaceEdit`. What is named takes the place of what the .blend keeps;
`null` takes all of a material's or object's edits off.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...json_file import read_json
from ...scene.surface_edit import NO_EDIT, SurfaceEdit, SurfaceEdits

# A name to what changes about it; None for nothing any more.
Changes = Mapping[str, Mapping[str, Any] | None]

_TINTS = ("tint", "specular_tint")
_ATTRIBUTES = tuple(each.name for each in fields(SurfaceEdit))


@dataclass(frozen=True)
class SurfaceChanges:
    """What such a file says, its values checked: attributes of `SurfaceEdit` by name."""

    materials: Changes = field(default_factory=dict)
    objects: Changes = field(default_factory=dict)

    def over(
        self, edits: SurfaceEdits, materials: Collection[str], objects: Collection[str]
    ) -> SurfaceEdits:
        """The edits of a scene with these in their place.

        Args:
            edits: that the scene has.
            materials: names of its materials.
            objects: names of its objects.

        Raises:
            InputError: there is no such material or object.
        """
        return SurfaceEdits(
            _over(edits.materials, self.materials, materials, "material"),
            _over(edits.objects, self.objects, objects, "object"),
        )


NO_CHANGES = SurfaceChanges()


def _over(
    edits: Mapping[str, SurfaceEdit], changes: Changes, known: Collection[str], kind: str
) -> dict[str, SurfaceEdit]:
    result = dict(edits)
    for name, values in changes.items():
        if name not in known:
            names = ", ".join(sorted({each for each in known if each})) or "none"
            raise InputError(f"there is no {kind} '{name}'; the scene's {kind}s are: {names}")
        before = result.get(name, NO_EDIT)
        result[name] = NO_EDIT if values is None else replace(before, **values)
    return result


def read_surface_changes(path: Path) -> SurfaceChanges:
    """Read SURFACES.json.

    Raises:
        InputError: it can't be read, is not JSON, or something in it can't be.
    """
    data = read_json(path, "surface edits")
    if not isinstance(data, dict) or not set(data) <= {"materials", "objects"}:
        raise InputError(
            f"the surface edits '{path}' must be a JSON object with 'materials' and 'objects'"
        )
    parts = {kind: _checked(path, kind, data.get(kind, {})) for kind in ("materials", "objects")}
    return SurfaceChanges(**parts)


def _checked(path: Path, kind: str, part: Any) -> dict[str, dict[str, Any] | None]:
    if not isinstance(part, dict):
        raise InputError(f"'{kind}' in '{path}' must be a JSON object with names of {kind}")
    checked: dict[str, dict[str, Any] | None] = {}
    for name, values in part.items():
        what = f"{kind[:-1]} '{name}' in '{path}'"
        if values is None:
            checked[name] = None
            continue
        if not isinstance(values, dict):
            raise InputError(f"{what} must have an object of attributes, or null for no edit")
        given = {key: _value(what, key, value) for key, value in values.items()}
        try:
            SurfaceEdit(**given)
        except InputError as error:
            raise InputError(f"{what}: {error}") from error
        checked[name] = given
    return checked


def _value(what: str, attribute: str, value: Any) -> Any:
    if attribute not in _ATTRIBUTES:
        known = ", ".join(_ATTRIBUTES)
        raise InputError(f"{what} has no attribute '{attribute}' to edit; there are: {known}")
    if attribute in _TINTS:
        if not isinstance(value, list) or len(value) != 3:
            raise InputError(
                f"'{attribute}' of {what} must be a list of 3 numbers, not {json.dumps(value)}"
            )
        return tuple(_number(what, attribute, item) for item in value)
    return _number(what, attribute, value)


def _number(what: str, attribute: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"'{attribute}' of {what} must be a number, not {json.dumps(value)}")
    try:
        return float(value)
    except OverflowError as error:
        raise InputError(f"'{attribute}' of {what} is too large") from error
