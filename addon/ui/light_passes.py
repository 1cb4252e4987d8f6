# SPDX-License-Identifier: GPL-3.0-or-later
"""Render passes, one for each light, for the compositor and multi-layer files."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..relight.graph.frame_passes import EMISSION_LAYER, WORLD_LAYER

# Blender keeps a pass's name in 64 bytes.
_LONGEST = 63

Pixels = NDArray[np.float32]


def light_passes(scene: Any) -> dict[str, str]:
    """Names of the passes that a scene's lights, its world and what glows have.

    Returns:
        pass names by the names that `Picture.layers` has them under; an instance's light is in
        the pass of its light object.
    """
    lights = [obj.name for obj in scene.objects if obj.type == "LIGHT"]
    passes = {name: _free(f"Light {name}", ()) for name in lights}
    for name, text in ((WORLD_LAYER, "Light of World"), (EMISSION_LAYER, "Light of Surfaces")):
        passes[f"{name} (scene)" if name in passes else name] = text
    used: list[str] = []
    for name, text in passes.items():
        passes[name] = _free(text, used)
        used.append(passes[name])
    return passes


def add_up(
    size: tuple[int, int],
    layers: Mapping[str, Pixels],
    passes: Mapping[str, str],
    glowing: Collection[str] = (),
) -> dict[str, Pixels]:
    """The pixels of each pass, (H, W, 3): those of its light and of that light's instances.

    Args:
        size: height and width of the picture, which may have no layer.
        layers: by name.
        passes: from `light_passes`.
        glowing: layers that are the light of glowing objects, which goes with what glows.
    """
    scene_emission = f"{EMISSION_LAYER} (scene)"
    surfaces = passes.get(scene_emission, passes.get(EMISSION_LAYER))
    pixels = {name: np.zeros((*size, 3), dtype=np.float32) for name in passes.values()}
    for layer, seen in layers.items():
        # "Lamp post/Bulb #2" is the second "Bulb" that "Lamp post" instances.
        plain = layer.rpartition(" #")[0] or layer
        candidates = (layer, plain, plain.rpartition("/")[2], layer.rpartition("/")[2])
        name = next((passes[c] for c in candidates if c in passes), None)
        name = surfaces if layer in glowing else name
        if name is not None:
            pixels[name] += seen
    return pixels


def _free(name: str, used: list[str] | tuple[str, ...]) -> str:
    found, number = _cut(name), 1
    while found in used:
        number += 1
        found = _cut(name, f" {number}")
    return found


def _cut(name: str, end: str = "") -> str:
    """A name of at most so many bytes, no letter cut in two."""
    room = _LONGEST - len(end)
    return name.encode()[:room].decode(errors="ignore") + end
