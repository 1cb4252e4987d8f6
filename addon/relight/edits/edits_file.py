# SPDX-License-Identifier: GPL-3.0-or-later
"""EDITS.json: what to change about a scene's lights, by Blender's own names.

    {"Key": {"energy": 300.0, "location": [1, 2, 3], "color": [1, 0.8, 0.6]}, "Rim": null}
    {"Key": {"barn_doors.use": true, "barn_doors.width": 0.3, "shadow.color": [0, 0, 0.2]}}

Names with a dot, and the weights, are Relume's own controls (`control_edits`).

The edits are applied to Blender's data, so that Relume and Cycles read the same lights, and
taken back afterwards.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...json_file import read_json
from ...scene.animation_reader import animation_curves
from ...scene.image_reader import find_image
from .control_edits import control_names, find_block, find_control

# A light's name to what changes about it; None switches it off.
Edits = Mapping[str, Mapping[str, Any] | None]

# Blender's names for what can be edited, of a light's object and of the light itself.
OBJECT_ATTRIBUTES = ("location", "rotation_euler", "scale")
LIGHT_ATTRIBUTES = (
    "energy",
    "color",
    "exposure",
    "normalize",
    "use_temperature",
    "temperature",
    "use_shadow",
    "shadow_soft_size",
    "use_soft_falloff",
    "spot_size",
    "spot_blend",
    "angle",
    "shape",
    "size",
    "size_y",
    "spread",
)


def read_edits(path: Path) -> Edits:
    """Read EDITS.json.

    Raises:
        InputError: it can't be read, is not JSON, or not an object of objects and nulls.
    """
    edits = read_json(path, "light edits")
    if not isinstance(edits, dict):
        raise InputError(f"the light edits '{path}' must be a JSON object with lights' names")
    for name, changes in edits.items():
        if not isinstance(changes, dict | None):
            raise InputError(
                f"light '{name}' in '{path}' must have an object of attributes, or null to "
                "switch it off"
            )
    return edits


@contextmanager
def applied_edits(scene: Any, edits: Edits) -> Iterator[None]:
    """Apply edits to a `bpy.types.Scene`'s lights, and take them back at the end.

    An animated or driven attribute that is edited stands still meanwhile. A light whose data
    other objects share gets its own. Nothing is changed when an edit can't be.

    Raises:
        InputError: an unknown light or attribute, or a value that it cannot have.
    """
    lights = {obj.name: obj for obj in scene.objects if obj.type == "LIGHT"}
    checked: list[tuple[Any, list[_Change] | None]] = []
    for name, changes in edits.items():
        if name not in lights:
            known = ", ".join(sorted(lights)) or "none"
            raise InputError(f"there is no light '{name}'; the scene's lights are: {known}")
        light = lights[name]
        checked.append((light, None if changes is None else _checked(scene, light, changes)))
    with ExitStack() as restore:
        for light, values in checked:
            _apply(light, values, restore)
        yield


@dataclass(frozen=True)
class _Change:
    """A value for a property of a data-block: a light's object, or its data."""

    of_object: bool
    path: str
    value: Any


def _checked(scene: Any, light: Any, changes: Mapping[str, Any]) -> list[_Change]:
    """The changes with values in Blender's own types."""
    return [_change(scene, light, attribute, value) for attribute, value in changes.items()]


def _change(scene: Any, light: Any, attribute: str, value: Any) -> _Change:
    what = f"'{attribute}' of light '{light.name}'"
    if attribute in OBJECT_ATTRIBUTES:
        declared = light.bl_rna.properties[attribute]
        return _Change(True, attribute, _value(what, declared, value))
    if attribute not in LIGHT_ATTRIBUTES:
        found = find_control(light, attribute)
        if found is None:
            known = ", ".join((*OBJECT_ATTRIBUTES, *LIGHT_ATTRIBUTES, *control_names(light)))
            raise InputError(
                f"light '{light.name}' has no attribute '{attribute}' to edit; there are: {known}"
            )
        path, declared = found
        if declared.type != "POINTER":
            return _Change(False, path, _value(what, declared, value))
        is_image = declared.fixed_type.identifier == "Image"
        blocks = _Images() if is_image else scene.objects
        return _Change(False, path, find_block(what, declared, value, blocks))
    declared = light.data.bl_rna.properties.get(attribute)
    if declared is None:
        kind = light.data.type.lower()
        kind = f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"
        raise InputError(
            f"light '{light.name}' is {kind} light, which has no '{attribute}'; leave it out"
        )
    return _Change(False, attribute, _value(what, declared, value))


class _Images:
    """The open file's images."""

    def get(self, name: str) -> Any:
        return find_image(name)


def _value(what: str, declared: Any, value: Any) -> Any:
    if declared.type == "BOOLEAN":
        if not isinstance(value, bool):
            raise InputError(f"{what} must be true or false, not {json.dumps(value)}")
        return value
    if declared.type == "ENUM":
        known = [item.identifier for item in declared.enum_items]
        if value not in known:
            raise InputError(f"{what} must be one of {', '.join(known)}, not {json.dumps(value)}")
        return value
    count = declared.array_length
    if not count:
        return _number(what, declared, value)
    if not isinstance(value, list) or len(value) != count:
        raise InputError(f"{what} must be a list of {count} numbers, not {json.dumps(value)}")
    return [_number(what, declared, item) for item in value]


def _number(what: str, declared: Any, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{what} must be a finite number, not {json.dumps(value)}")
    try:
        value = float(value)
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise InputError(f"{what} must be a finite number, not {json.dumps(value)}")
    low, high = declared.hard_min, declared.hard_max
    # Blender keeps float32, so that its own pi and limits come back a rounding away.
    slack = 1e-6 * max(abs(value), 1.0)
    if not low - slack <= value <= high + slack:
        raise InputError(f"{what} must be between {low:g} and {high:g}, not {value:g}")
    return float(value)


def _apply(light: Any, changes: list[_Change] | None, restore: ExitStack) -> None:
    if changes is None:
        _set(light, "hide_render", True, restore)
        return
    if light.data.users > 1 and any(not change.of_object for change in changes):
        _make_single_user(light, restore)
    for change in changes:
        _set(light if change.of_object else light.data, change.path, change.value, restore)
    turned = [change.value for change in changes if change.path == "rotation_euler"]
    if turned and light.rotation_mode in ("QUATERNION", "AXIS_ANGLE"):
        # Blender converts the rotation whenever the mode changes, also back.
        for path in ("rotation_quaternion", "rotation_axis_angle"):
            restore.callback(setattr, light, path, tuple(getattr(light, path)))
        _set(light, "rotation_mode", "XYZ", restore)
        light.rotation_euler = turned[-1]


def _make_single_user(light: Any, restore: ExitStack) -> None:
    shared = light.data
    light.data = shared.copy()

    # The copy is left without a user, and Blender drops it when the file is saved or closed.
    restore.callback(setattr, light, "data", shared)


def _set(block: Any, path: str, value: Any, restore: ExitStack) -> None:
    """Set a property, stop what animates it, and arrange for both to be taken back."""
    for curve in animation_curves(block):
        if curve.data_path == path and not curve.mute:
            curve.mute = True
            restore.callback(setattr, curve, "mute", False)
    group, _, attribute = path.rpartition(".")
    owner = block.path_resolve(group) if group else block
    before = getattr(owner, attribute)
    if hasattr(before, "__len__") and not isinstance(before, str):
        before = tuple(before)
    restore.callback(setattr, owner, attribute, before)
    setattr(owner, attribute, value)
