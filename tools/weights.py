# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's weights: how much objects and materials matter to the placement."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from addon.errors import InputError
from addon.scene.geometry import SceneGeometry


def read_weights(path: Path) -> Mapping[str, float]:
    """Read a weights file: {"name of an object or a material": 0 to 1}.

    Raises:
        InputError: it is missing or not such a file.
    """
    try:
        weights = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); check the path.") from None
    except ValueError as error:
        raise InputError(f"{path} is not JSON ({error}); correct it.") from None
    if not isinstance(weights, dict):
        raise InputError(f"{path} is not a JSON object of names and weights; correct it.")
    for name, weight in weights.items():
        number = isinstance(weight, int | float) and not isinstance(weight, bool)
        if not number or not 0.0 <= weight <= 1.0:
            raise InputError(f"{path}: the weight of '{name}' is not a number from 0 to 1.")
    return weights


def with_weights(geometry: SceneGeometry, weights: Mapping[str, float]) -> SceneGeometry:
    """The same triangles with the weights of the named objects and materials (their product).

    Raises:
        InputError: a name is neither an object's nor a material's.
    """
    unknown = set(weights) - set(geometry.object_names) - set(geometry.material_names)
    if unknown:
        raise InputError(
            f"There is no object or material '{min(unknown)}' to weight; check the name."
        )
    by_object = np.array([weights.get(name, 1.0) for name in geometry.object_names])
    by_material = np.array([weights.get(name, 1.0) for name in geometry.material_names])
    factor = by_object[geometry.object_id] * by_material[geometry.material_id]
    return replace(geometry, weight=(geometry.weight * factor).astype(np.float32))
